#include "services/archiver/answering.hpp"

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "services/archiver/request.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::archiver {

tl::expected<Put, sdk::Response> put_of(const CallInfo& call, fabric::Time now) {
  auto fields = parse(call.request);
  if (!fields) {
    return tl::unexpected(text::error(text::state_bad_request, fields.error()));
  }
  for (Field& field : *fields) {
    field.value = base::text::to_utf8(field.value);
  }
  return Put{.call = call.call,
             .key = call.key,
             .at = now,
             .state = call.state,
             .text = base::text::to_utf8(call.request),
             .fields = *std::move(fields),
             .replayed = call.replayed};
}

sdk::Response answer_to(const Written& written) {
  if (!written) {
    return text::error(state_not_written, "the archive cannot be written: " + written.error());
  }
  return {.text = fmt::format("OK {}", *written), .state = text::state_ok};
}

}  // namespace millrace::services::archiver
