#include "services/mail/request.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "services/text/answer.hpp"
#include "services/text/fields.hpp"
#include "services/text/words.hpp"

namespace millrace::services::mail {

namespace {

constexpr const char* to_key = "to";

tl::expected<std::vector<std::string>, std::string> names(std::string_view list) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t comma = std::min(list.find(',', at), list.size());
    const std::string_view name = list.substr(at, comma - at);
    if (!text::is_name(name)) {
      return tl::unexpected("no recipient can be called " + text::in_quotes(name));
    }
    names.emplace_back(name);
    at = comma + 1;
  }
  return names;
}

}  // namespace

tl::expected<Request, std::string> parse(std::string_view request) {
  const auto words = text::words(request);
  if (words.empty()) {
    return tl::unexpected(std::string("the request is empty; expected TEMPLATE key=value ..."));
  }
  const auto odd = std::find_if(request.begin(), request.end(),
                                [](char c) { return c != '\t' && !text::prints(c); });
  if (odd != request.end()) {
    return tl::unexpected(fmt::format("byte {} of the request (0x{:02X}) is not text",
                                      odd - request.begin() + 1, static_cast<unsigned char>(*odd)));
  }
  if (!text::is_name(words[0])) {
    return tl::unexpected("no template can be called " + text::in_quotes(words[0]));
  }
  Request parsed{.template_name = std::string(words[0]), .to = {}, .values = {}};
  auto fields = text::fields(
      request.substr(static_cast<std::size_t>(words[0].data() - request.data()) + words[0].size()));
  if (!fields) {
    return tl::unexpected(fields.error());
  }
  for (text::Field& field : *fields) {
    if (field.key == to_key) {
      auto to = names(field.value);
      if (!to) {
        return tl::unexpected(to.error());
      }
      parsed.to = *std::move(to);
    } else {
      parsed.values.emplace(std::move(field.key), base::text::to_utf8(field.value));
    }
  }
  return parsed;
}

}  // namespace millrace::services::mail
