// How variables and their values are shown.
#include <cmath>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "cnc/variables/names.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::vars {

namespace {

using cnc::variables::Element;

struct ToText {
  std::string operator()(bool value) const { return value ? "TRUE" : "FALSE"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return fmt::format("{}", value); }
  std::string operator()(const std::string& value) const { return base::text::quoted(value); }
};

struct ToJson {
  boost::json::value operator()(bool value) const { return value; }
  boost::json::value operator()(std::int64_t value) const { return value; }
  /// JSON has no word for what is not a number.
  boost::json::value operator()(double value) const {
    return std::isfinite(value) ? boost::json::value(value)
                                : boost::json::value(fmt::format("{}", value));
  }
  boost::json::value operator()(const std::string& value) const {
    return boost::json::string(print::text_json(value));
  }
};

}  // namespace

std::string text_of(const std::vector<Element>& elements, bool is_array) {
  std::string text;
  for (const Element& element : elements) {
    text += (text.empty() ? "" : ", ") + std::visit(ToText{}, element);
  }
  return is_array ? "[" + text + "]" : text;
}

boost::json::value json_of(const std::vector<Element>& elements, bool is_array) {
  boost::json::array values;
  for (const Element& element : elements) {
    values.push_back(std::visit(ToJson{}, element));
  }
  return is_array || values.empty() ? boost::json::value(std::move(values)) : values.front();
}

boost::json::object json_of(const cnc::variables::Description& description) {
  boost::json::array dimensions;
  for (const std::uint32_t length : description.dimensions) {
    dimensions.emplace_back(length);
  }
  return {{"name", print::utf8(description.name)},
          {"family", cnc::variables::family_of(description.name)},
          {"type", cnc::variables::name_of(description.type)},
          {"mode", cnc::variables::name_of(description.access)},
          {"size", description.size},
          {"dimensions", std::move(dimensions)}};
}

std::string type_text(const cnc::variables::Description& description) {
  std::string text(cnc::variables::name_of(description.type));
  for (const std::uint32_t length : description.dimensions) {
    text += fmt::format("[{}]", length);
  }
  return text;
}

}  // namespace millrace::tools::commands::vars
