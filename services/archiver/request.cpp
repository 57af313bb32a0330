#include "services/archiver/request.hpp"

#include "services/text/words.hpp"

namespace millrace::services::archiver {

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
