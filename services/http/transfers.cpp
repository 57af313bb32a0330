#include "services/http/transfers.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include "base/curl/easy.hpp"
#include "base/program/version.hpp"

namespace millrace::services::http {

namespace {

using base::curl::Easy;
using base::curl::set;

/// Until the endpoint accepts the connection.
constexpr std::chrono::milliseconds connect_limit{5000};
/// A connection that was idle for longer carries no request that must not be sent twice: the server
/// may be closing it (after 2 s at the earliest, by the defaults of common servers), and then
/// nothing shows whether it has read the request.
constexpr long most_idle_s = 1;

struct MultiDeleter {
  void operator()(CURLM* handle) const { curl_multi_cleanup(handle); }
};
void set_pem(const Easy& handle, CURLoption option, const std::string& pem) {
  if (!pem.empty()) {
    // libcurl's type has no const. It copies the text.
    curl_blob blob{const_cast<char*>(pem.data()), pem.size(), CURL_BLOB_COPY};
    set(handle, option, &blob);
  }
}

std::string header_of(CURL* handle, const char* name) {
  curl_header* found = nullptr;
  return curl_easy_header(handle, name, 0, CURLH_HEADER, -1, &found) == CURLHE_OK ? found->value
                                                                                  : "";
}

/// One transfer, for libcurl's callbacks, which must not throw.
struct Running {
  Transfer transfer;
  Transfers::Done done;
  Easy handle = base::curl::make_easy();
  base::curl::List headers;
  std::array<char, CURL_ERROR_SIZE> reason{};
  std::string body{};
  /// Of headers and body.
  std::size_t received = 0;
  /// Connections on which the request was begun: libcurl sends it again if a connection that was
  /// used before ends without a response.
  unsigned begun = 0;

  [[nodiscard]] bool is_once() const {
    return transfer.post &&
           transfer.endpoint->announcement.delivery == fabric::Delivery::at_most_once;
  }
};

/// What libcurl expects of its callbacks.
std::size_t take(Running& running, std::size_t size) {
  running.received += size;
  return running.received > max_response ? CURL_WRITEFUNC_ERROR : size;
}

std::size_t on_header(char*, std::size_t size, std::size_t count, void* user) noexcept {
  return take(*static_cast<Running*>(user), size * count);
}

std::size_t on_body(char* data, std::size_t size, std::size_t count, void* user) noexcept {
  Running& running = *static_cast<Running*>(user);
  running.body.append(data, size * count);
  return take(running, size * count);
}

int on_begin(void* user, char*, char*, int, int) noexcept {
  Running& running = *static_cast<Running*>(user);
  ++running.begun;
  return running.begun > 1 && running.is_once() ? CURL_PREREQFUNC_ABORT : CURL_PREREQFUNC_OK;
}

void set_trust(const Easy& handle, const Endpoint& endpoint) {
  set_pem(handle, CURLOPT_CAINFO_BLOB, endpoint.ca.contents);
  if (!endpoint.ca.contents.empty()) {
    set(handle, CURLOPT_CAPATH, static_cast<const char*>(nullptr));
  }
  set_pem(handle, CURLOPT_SSLCERT_BLOB, endpoint.certificate.contents);
  set_pem(handle, CURLOPT_SSLKEY_BLOB, endpoint.key.contents);
  set(handle, CURLOPT_PROXY, endpoint.proxy.c_str());
  set(handle, CURLOPT_FOLLOWLOCATION, 0L);
  set(handle, CURLOPT_PROTOCOLS_STR, "http,https");
}

/// What does not differ from POST to POST of an endpoint.
void set_up(Running& running) {
  const Easy& handle = running.handle;
  const Transfer& transfer = running.transfer;
  set_trust(handle, *transfer.endpoint);
  set(handle, CURLOPT_URL, transfer.url.c_str());
  set(handle, CURLOPT_ERRORBUFFER, running.reason.data());
  set(handle, CURLOPT_USERAGENT, fmt::format("millrace-http/{}", base::program::version()).c_str());
  set(handle, CURLOPT_HEADERFUNCTION, &on_header);
  set(handle, CURLOPT_HEADERDATA, &running);
  set(handle, CURLOPT_WRITEFUNCTION, &on_body);
  set(handle, CURLOPT_WRITEDATA, &running);
  set(handle, CURLOPT_PREREQFUNCTION, &on_begin);
  set(handle, CURLOPT_PREREQDATA, &running);
  set(handle, CURLOPT_CONNECT_ONLY, transfer.connect_only ? 1L : 0L);
  if (running.is_once()) {
    set(handle, CURLOPT_MAXAGE_CONN, most_idle_s);
  }
}

void set_request(Running& running) {
  const Easy& handle = running.handle;
  const Transfer& transfer = running.transfer;
  set(handle, CURLOPT_CONNECTTIMEOUT_MS, std::min(transfer.limit, connect_limit));
  set(handle, CURLOPT_TIMEOUT_MS, transfer.limit);
  running.headers =
      base::curl::list_of(transfer.post ? transfer.post->headers : credentials(*transfer.endpoint));
  set(handle, CURLOPT_HTTPHEADER, running.headers.get());
  if (transfer.post) {
    set(handle, CURLOPT_POSTFIELDSIZE, static_cast<long>(transfer.post->body.size()));
    set(handle, CURLOPT_POSTFIELDS, transfer.post->body.c_str());
  }
}

Exchange::End end_of(const Running& running, CURLcode code) {
  /// CURLE_TOO_LARGE, of libcurl 8.6; before, it has no memory for a header of more than 100 KiB.
  constexpr int too_large = 100;
  if (running.received > max_response) {
    return Exchange::End::too_long;
  }
  if (code == CURLE_OK) {
    return Exchange::End::responded;
  }
  if (running.begun == 0) {
    return Exchange::End::not_sent;
  }
  switch (int{code}) {
    case CURLE_OPERATION_TIMEDOUT:
      return Exchange::End::time_limit;
    case CURLE_OUT_OF_MEMORY:
    case too_large:
      return Exchange::End::too_long;
    case CURLE_WEIRD_SERVER_REPLY:
    case CURLE_UNSUPPORTED_PROTOCOL:
      return Exchange::End::not_http;
    default:
      return Exchange::End::lost;
  }
}

Exchange exchange_of(Running& running, CURLcode code) {
  CURL* const handle = running.handle.get();
  Exchange exchange{.end = end_of(running, code), .body = std::move(running.body)};
  if (code != CURLE_OK) {
    exchange.reason = running.reason[0] != '\0' ? running.reason.data() : curl_easy_strerror(code);
    return exchange;
  }
  long status = 0;
  curl_easy_getinfo(handle, CURLINFO_RESPONSE_CODE, &status);
  exchange.status = static_cast<int>(status);
  exchange.content_type = header_of(handle, "Content-Type");
  exchange.location = header_of(handle, "Location");
  exchange.state = header_of(handle, "Millrace-State");
  if (!header_of(handle, "Retry-After").empty()) {
    curl_off_t seconds = 0;
    curl_easy_getinfo(handle, CURLINFO_RETRY_AFTER, &seconds);
    exchange.retry_after = std::chrono::seconds(seconds);
  }
  return exchange;
}

}  // namespace

struct Transfers::Impl {
  std::unique_ptr<CURLM, MultiDeleter> multi{curl_multi_init()};
  std::map<Id, std::unique_ptr<Running>> running;
  /// Of POSTs that have ended, for the next ones: to set up a handle costs as much as a request.
  std::map<std::shared_ptr<const Endpoint>, std::vector<std::unique_ptr<Running>>> idle;
  Id last = 0;

  std::unique_ptr<Running> make(Transfer transfer) {
    std::erase_if(idle, [](const auto& spares) { return spares.first.use_count() == 1; });
    auto& spare = idle[transfer.endpoint];
    if (transfer.post && !spare.empty()) {
      auto again = std::move(spare.back());
      spare.pop_back();
      again->transfer = std::move(transfer);
      return again;
    }
    auto made = std::make_unique<Running>();
    made->transfer = std::move(transfer);
    set_up(*made);
    return made;
  }

  std::unique_ptr<Running> take(Id id) {
    const auto node = running.extract(id);
    if (node.empty()) {
      return nullptr;
    }
    curl_multi_remove_handle(multi.get(), node.mapped()->handle.get());
    return std::move(node.mapped());
  }

  /// `done` may start and cancel transfers.
  void report(CURL* handle, CURLcode code) {
    const auto found = std::ranges::find_if(
        running, [&](const auto& transfer) { return transfer.second->handle.get() == handle; });
    if (found == running.end()) {
      return;
    }
    auto ended = take(found->first);
    const Exchange exchange = exchange_of(*ended, code);
    const Done done = std::move(ended->done);
    if (ended->transfer.post) {
      auto& spare = idle[ended->transfer.endpoint];
      ended->transfer = {};
      ended->body.clear();
      ended->received = ended->begun = 0;
      ended->reason[0] = '\0';
      spare.push_back(std::move(ended));
    }
    done(exchange);
  }
};

Transfers::Transfers() : impl_(std::make_unique<Impl>()) {
  if (!impl_->multi) {
    throw std::runtime_error("libcurl cannot be used");
  }
}

Transfers::~Transfers() {
  while (!impl_->running.empty()) {
    impl_->take(impl_->running.begin()->first);
  }
}

Transfers::Id Transfers::start(Transfer transfer, Done done) {
  auto running = impl_->make(std::move(transfer));
  running->done = std::move(done);
  set_request(*running);
  if (curl_multi_add_handle(impl_->multi.get(), running->handle.get()) != CURLM_OK) {
    throw std::runtime_error("libcurl refuses a transfer");
  }
  const Id id = ++impl_->last;
  impl_->running.emplace(id, std::move(running));
  return id;
}

void Transfers::cancel(Id id) {
  impl_->take(id);
}

void Transfers::run(std::chrono::milliseconds limit) {
  int running = 0;
  curl_multi_perform(impl_->multi.get(), &running);
  bool any = false;
  const auto report = [&] {
    int left = 0;
    while (const CURLMsg* const message = curl_multi_info_read(impl_->multi.get(), &left)) {
      any = true;
      impl_->report(message->easy_handle, message->data.result);
    }
  };
  report();
  if (!any) {
    curl_multi_poll(impl_->multi.get(), nullptr, 0, static_cast<int>(limit.count()), nullptr);
    curl_multi_perform(impl_->multi.get(), &running);
    report();
  }
}

void Transfers::wake() {
  curl_multi_wakeup(impl_->multi.get());
}

}  // namespace millrace::services::http
