#include "tools/web/http/message.hpp"

#include <boost/json/parse.hpp>

#include "base/text/ascii.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::http {

Response json_response(const boost::json::value& value, unsigned status) {
  return {.status = status,
          .body = std::make_shared<const std::string>(print::json_text(value) + "\n"),
          // State changes all the time.
          .headers = {{"Cache-Control", "no-store"}}};
}

Response error_response(unsigned status, std::string_view what) {
  return json_response(boost::json::object{{"error", print::utf8(what)}}, status);
}

std::optional<boost::json::object> object_in(std::string_view body) {
  boost::system::error_code error;
  boost::json::value value = boost::json::parse({body.data(), body.size()}, error);
  return error || !value.is_object() ? std::nullopt : std::optional(std::move(value.get_object()));
}

std::optional<std::string> text_in(const boost::json::object& object, const char* name) {
  const auto* field = object.if_contains(name);
  const auto* text = field == nullptr ? nullptr : field->if_string();
  return text == nullptr ? std::nullopt : std::optional<std::string>({text->data(), text->size()});
}

namespace {

/// "%C3%A4" → "ä"; nothing for a '%' without two hexadecimal digits.
std::optional<std::string> decoded(std::string_view text, bool plus_is_blank) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus_is_blank) {
      out += ' ';
    } else if (text[i] != '%') {
      out += text[i];
    } else {
      const auto byte = i + 2 < text.size()
                            ? base::text::parse_number<std::uint8_t>(text.substr(i + 1, 2), 16)
                            : std::nullopt;
      if (!byte) {
        return std::nullopt;
      }
      out += static_cast<char>(*byte);
      i += 2;
    }
  }
  return out;
}

bool is_name(const std::string& text) {
  return !text.empty() && text != "." && text != ".." && text.find('/') == std::string::npos &&
         text.find('\0') == std::string::npos;
}

/// Takes the part up to `end` off `text`, together with `end`.
std::string_view cut(std::string_view& text, char end) {
  const std::size_t place = text.find(end);
  const std::string_view part = text.substr(0, place);
  text = place == std::string_view::npos ? std::string_view{} : text.substr(place + 1);
  return part;
}

}  // namespace

std::string Target::value(const std::string& name) const {
  const auto found = query.find(name);
  return found == query.end() ? std::string() : found->second.back();
}

std::vector<std::string> Target::values(const std::string& name) const {
  const auto found = query.find(name);
  return found == query.end() ? std::vector<std::string>() : found->second;
}

std::optional<Target> parse_target(std::string_view text) {
  if (!text.starts_with('/')) {
    return std::nullopt;
  }
  std::string_view query = text;
  std::string_view path = cut(query, '?').substr(1);
  Target target;
  while (!path.empty()) {
    auto part = decoded(cut(path, '/'), false);
    if (!part || !is_name(*part)) {
      return std::nullopt;
    }
    target.path.push_back(std::move(*part));
  }
  while (!query.empty()) {
    std::string_view value = cut(query, '&');
    auto name = decoded(cut(value, '='), true);
    auto meaning = decoded(value, true);
    if (!name || !meaning) {
      return std::nullopt;
    }
    target.query[std::move(*name)].push_back(std::move(*meaning));
  }
  return target;
}

}  // namespace millrace::tools::web::http
