#include "services/archiver/answering.hpp"

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "services/text/answer.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::archiver {

tl::expected<Put, sdk::Response> put_of(const fabric::Request& call, fabric::Time now) {
  auto fields = parse(call.text);
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
             .text = base::text::to_utf8(call.text),
             .fields = *std::move(fields),
             .replayed = call.replayed};
}

sdk::Response answer_to(const Written& written) {
  if (!written) {
    return text::error(state_not_written, "the archive cannot be written: " + written.error());
  }
  return {.text = fmt::format("OK {}", *written), .state = text::state_ok};
}

tl::expected<std::vector<Field>, std::string> parse(std::string_view request) {
  const auto words = text::words(request);
  if (words.empty()) {
    return tl::unexpected(std::string("the request is empty; expected PUT key=value ... or text"));
  }
  if (text::upper_case(words[0]) != "PUT") {
    return std::vector<Field>{};
  }
  const auto behind_verb = static_cast<std::size_t>(words[0].end() - request.begin());
  auto fields = text::fields(request.substr(behind_verb));
  if (fields && fields->empty()) {
    return tl::unexpected(std::string("PUT without key=value"));
  }
  return fields;
}

}  // namespace millrace::services::archiver
