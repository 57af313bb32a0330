// Any bytes as the response of a web server: the answer fits the CNC, and a result is looked for on
// the same host only.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "services/http/message.hpp"

using namespace millrace::services::http;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

void check(const millrace::services::sdk::Response& answer, bool final) {
  require(answer.state != 0 || !final);
  require(answer.text.size() <= 127);
  require(answer.text.find('\0') == std::string::npos);
}

}  // namespace

/// The first byte chooses the status, the second the content type and which header the rest is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) {
    return 0;
  }
  constexpr int statuses[] = {200, 202, 204, 302, 400, 404, 429, 500, 503};
  const char* const types[] = {"application/json", "text/plain",
                               "text/html",        "",
                               "image/png",        "Application/X+JSON ; charset=x"};
  const std::string bytes(reinterpret_cast<const char*>(data + 2), size - 2);
  Exchange exchange{.status = statuses[data[0] % std::size(statuses)],
                    .content_type = types[data[1] % std::size(types)],
                    .body = bytes};
  const std::string line = bytes.substr(0, bytes.find('\0'));
  if ((data[1] & 0x20U) != 0) {
    exchange.location = line;
  }
  if ((data[1] & 0x40U) != 0) {
    exchange.state = line;
  }
  if ((data[1] & 0x80U) != 0) {
    exchange.retry_after = std::chrono::seconds(data[0]);
  }
  const Endpoint endpoint{.announcement = {.name = "press"}, .url = "http://127.0.0.1:8000/x"};
  const Verdict verdict = judge(endpoint, exchange);
  if (const auto* answer = std::get_if<Answer>(&verdict)) {
    check(answer->response, true);
  } else if (const auto* accepted = std::get_if<Accepted>(&verdict)) {
    require(accepted->url.starts_with("http://127.0.0.1:8000/"));
    if (accepted->interim) {
      check(*accepted->interim, false);
    }
  }
  return 0;
}
