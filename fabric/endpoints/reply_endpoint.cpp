#include "fabric/endpoints/reply_endpoint.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/dds/listeners.hpp"
#include "fabric/endpoints/burst.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

namespace {

/// The last response to this many channels of gateways stays for readers that find this endpoint
/// later. Far more than ever wait, and as many as the service remembers calls; about 2 kB each,
/// also of callers that have left (docs/dev/measurements/footprint.md).
constexpr std::size_t most_answered = 1024;

/// Any requester.
RequestKey any_of(RequestKey key) {
  key.requester = 0;
  return key;
}

/// Marks its thread as the one that is reading requests.
class Reading {
 public:
  explicit Reading(std::atomic<std::thread::id>& mark) : mark_(mark) {
    mark_ = std::this_thread::get_id();
  }
  ~Reading() { mark_ = std::thread::id(); }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

 private:
  std::atomic<std::thread::id>& mark_;
};

/// Only a sample withdraws a request: DDS names the writer of each sample, but not the writer that
/// disposed a key whose samples are still untaken.
bool takes_back(const wire::Taken<Request>& taken) {
  return taken.valid && taken.authorization == Authorization::granted && is_withdrawal(taken.value);
}

}  // namespace

struct ReplyEndpoint::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, InstanceIdentity own_identity,
       ReplyEndpointListener& own_listener)
      : participant(own_participant),
        identity(std::move(own_identity)),
        listener(&own_listener),
        replies(participant,
                wire::service_partition(own_participant.options().fabric, identity.uuid),
                {.user_data = registry::format_instance(identity.id), .batched = true}) {}

  void open(const boost::asio::any_io_executor& executor, Receiving receiving);
  void close();
  void drain();
  void on_data() noexcept;
  void flush();
  void tell(const wire::Taken<Request>& taken, bool is_over);
  void decline(const wire::Taken<Request>& taken);
  void add_requester(const wire::Taken<Request>& taken);
  tl::expected<void, std::string> answer(const Reply& reply);

  dds::Participant& participant;
  const InstanceIdentity identity;
  /// Null once the end is closed.
  ReplyEndpointListener* listener;
  wire::Writer<Reply> replies;
  std::mutex answering;
  RecentRequests<> answered{most_answered};
  /// Which authorized requester sent which request: an unauthorized one is not recorded, and only
  /// the requester itself can withdraw. Guarded by `answering`.
  RecentRequests<std::uint64_t> requesters{most_answered};
  LogLimiter log_limiter;
  /// The thread that is reading requests: its replies are sent together.
  std::atomic<std::thread::id> reading{};
  /// Written, but not sent. Guarded by `answering`.
  bool unsent = false;
  /// Direct receiving only.
  Burst burst;
  // Before the reader that wakes them; without direct receiving only the first.
  std::optional<dds::PostOnce> post;
  std::optional<dds::SerialListener> serial;
  std::optional<wire::Reader<Request>> requests;
};

void ReplyEndpoint::Impl::open(const boost::asio::any_io_executor& executor, Receiving receiving) {
  const dds::Listener on_request(dds_create_listener(nullptr));
  if (receiving == Receiving::directly) {
    serial.emplace([this] {
      drain();
      flush();
    });
    post.emplace(executor, weak_from_this(), [this] { serial->run(); });
    dds_lset_data_available_arg(
        on_request.get(),
        [](dds_entity_t, void* self) noexcept { static_cast<Impl*>(self)->on_data(); }, this, true);
  } else {
    post.emplace(executor, weak_from_this(), [this] {
      drain();
      flush();
    });
    post->listen_for_data(on_request.get());
  }
  requests.emplace(
      participant,
      wire::request_partition(participant.options().fabric, identity.uuid, identity.id),
      // All of them, so that a stranger cannot displace a gateway's requests.
      wire::Keep::all,
      wire::EndpointOptions{.user_data = registry::format_identity(identity),
                            .listener = on_request.get(),
                            .deliver_unauthorized = true});
  if (serial) {
    serial->open();
  }
}

void ReplyEndpoint::Impl::close() {
  requests->silence();
  listener = nullptr;
  requests.reset();
  flush();
}

void ReplyEndpoint::Impl::on_data() noexcept {
  if (burst.on_sample(std::chrono::steady_clock::now())) {
    serial->run();
    burst.on_handled(std::chrono::steady_clock::now());
  } else {
    post->post();
  }
}

void ReplyEndpoint::Impl::flush() {
  const std::lock_guard lock(answering);
  if (std::exchange(unsent, false)) {
    replies.flush();
  }
}

void ReplyEndpoint::Impl::drain() {
  const Reading now(reading);
  // Each callback may close this end.
  while (listener != nullptr) {
    auto batch = requests->take();
    while (const auto flood = requests->take_flooding()) {
      if (const auto line =
              log_limiter.admit("keys", *flood, *flood, std::chrono::steady_clock::now())) {
        listener->on_ignored(*line);
      }
      if (listener == nullptr) {
        return;
      }
    }
    if (batch.empty()) {
      return;
    }
    for (wire::Taken<Request>& taken : batch) {
      taken.value.requester =
          requests->authorizer().requester_of(taken.writer, taken.value.key.machine);
    }
    for (auto taken = batch.begin(); taken != batch.end() && listener != nullptr; ++taken) {
      tell(*taken, std::any_of(taken + 1, batch.end(), [&](const wire::Taken<Request>& later) {
        return takes_back(later) && key_of(later.value) == key_of(taken->value);
      }));
    }
  }
}

/// `is_over`: a later sample of the same batch withdraws it.
void ReplyEndpoint::Impl::tell(const wire::Taken<Request>& taken, bool is_over) {
  if (taken.authorization != Authorization::granted) {
    decline(taken);
    return;
  }
  add_requester(taken);
  if (listener == nullptr) {
    return;
  }
  if (takes_back(taken)) {
    listener->on_withdrawn(key_of(taken.value));
  } else if (taken.instance_state == wire::InstanceState::no_writers) {
    // Its request may also be here, untaken: a gateway that leaves overtakes it.
    listener->on_orphaned(key_of(taken.value));
  } else if (taken.valid && !is_over && taken.value.assigned == identity.id) {
    // The partition belongs to this instance; a request for another one in it is a mistake.
    listener->on_request(taken.value);
  }
}

/// A restarted gateway requests with another writer than before, once; a stranger that uses its
/// call ids looks the same at first.
void ReplyEndpoint::Impl::add_requester(const wire::Taken<Request>& taken) {
  const RequestKey key = key_of(taken.value);
  std::string reason;
  {
    const std::lock_guard lock(answering);
    const bool asks = taken.valid && !is_withdrawal(taken.value);
    std::uint64_t* const known = asks ? requesters.use(any_of(key)) : requesters.find(any_of(key));
    if (known == nullptr) {
      if (asks) {
        requesters.put(any_of(key), key.requester);
      }
      return;
    }
    if (*known == key.requester || taken.instance_state == wire::InstanceState::no_writers) {
      return;
    }
    if (asks) {
      *known = key.requester;
    }
    if (auto line = log_limiter.admit(
            "requester", std::to_string(taken.writer),
            fmt::format("{}: participant {} {} epoch {:x}, which belongs to another requester{}",
                        base::text::safe(key.key.to_string()), requests->program_of(taken.writer),
                        asks ? "asks in" : "cancels a call of", key.epoch,
                        asks ? "" : ": the call goes on"),
            std::chrono::steady_clock::now())) {
      reason = *std::move(line);
    }
  }
  if (!reason.empty()) {
    listener->on_ignored(reason);
  }
}

void ReplyEndpoint::Impl::decline(const wire::Taken<Request>& taken) {
  const Request& request = taken.value;
  requests->authorizer().warn_limited(taken.writer, wire::authorization_scope_of(request),
                                      wire::request_topic.name);
  if (!taken.valid || taken.instance_state != wire::InstanceState::alive ||
      request.assigned != identity.id) {
    return;
  }
  {
    // A reply to an authorized gateway is readable by that gateway alone.
    const std::lock_guard lock(answering);
    if (requesters.contains(any_of(key_of(request)))) {
      return;
    }
  }
  static_cast<void>(answer({.key = request.key,
                            .instance = identity.id,
                            .call = request.call,
                            .attempt = request.attempt,
                            .kind = ReplyKind::declined,
                            .code = ServiceCode::refused,
                            .text = "the requester's certificate does not name this machine"}));
}

tl::expected<void, std::string> ReplyEndpoint::Impl::answer(const Reply& reply) {
  const std::lock_guard lock(answering);
  if (const auto old = answered.put(key_of(reply))) {
    replies.unregister(
        {.key = old->key.key, .instance = identity.id, .call = {.epoch = old->key.epoch}});
  }
  auto written = replies.write(reply);
  unsent = reading == std::this_thread::get_id();
  if (!unsent) {
    replies.flush();
  }
  return written;
}

namespace {

InstanceIdentity checked(InstanceIdentity identity) {
  if (const auto reason = registry::check_identity(identity)) {
    throw std::invalid_argument(
        fmt::format("the instance '{}' cannot join the fabric: {}", identity.name, *reason));
  }
  return identity;
}

}  // namespace

ReplyEndpoint::ReplyEndpoint(dds::Participant& participant,
                             const boost::asio::any_io_executor& executor,
                             InstanceIdentity identity, ReplyEndpointListener& listener,
                             Receiving receiving)
    : impl_(std::make_shared<Impl>(participant, checked(std::move(identity)), listener)) {
  impl_->open(executor, receiving);
}

ReplyEndpoint::~ReplyEndpoint() {
  impl_->close();
}

tl::expected<void, std::string> ReplyEndpoint::publish(const Reply& reply) {
  if (reply.kind == ReplyKind::final && reply.state == 0 &&
      impl_->identity.completion_signal == CompletionSignal::response_state) {
    return tl::unexpected(
        std::string("a final reply with state 0 does not release the NC program"));
  }
  return impl_->answer(reply);
}

void ReplyEndpoint::set_draining(bool draining) {
  InstanceIdentity identity = impl_->identity;
  identity.draining = draining;
  impl_->requests->set_user_data(registry::format_identity(identity));
}

const InstanceIdentity& ReplyEndpoint::identity() const {
  return impl_->identity;
}

}  // namespace millrace::fabric::endpoints
