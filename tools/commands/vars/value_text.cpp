// How variables and their values are shown.
#include <cmath>

#include <boost/json/array.hpp>
#include <boost/json/value_from.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "cnc/variables/names.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::vars {

namespace {

using cnc::variables::Description;
using cnc::variables::Element;
using print::Align;
using print::Cell;

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

boost::json::object json_of(const Description& description) {
  return {{"name", print::utf8(description.name)},
          {"family", cnc::variables::family_of(description.name)},
          {"type", cnc::variables::name_of(description.type)},
          {"mode", cnc::variables::name_of(description.access)},
          {"size", description.size},
          {"dimensions", boost::json::value_from(description.dimensions)}};
}

namespace {

/// "SGN16[3]" for an array.
Cell type_of(const Description& description) {
  std::string text(cnc::variables::name_of(description.type));
  for (const std::uint32_t length : description.dimensions) {
    text += fmt::format("[{}]", length);
  }
  return text;
}
Cell element_type_of(const Description& description) {
  return std::string(cnc::variables::name_of(description.type));
}
Cell family_of(const Description& description) {
  return std::string(cnc::variables::family_of(description.name));
}
Cell mode_of(const Description& description) {
  return std::string(cnc::variables::name_of(description.access));
}
Cell size_of(const Description& description) {
  return std::int64_t{description.size};
}
Cell dimensions_of(const Description& description) {
  return boost::json::value_from(description.dimensions);
}

}  // namespace

const print::Listing<Description>& variables_listing() {
  static const print::Listing<Description> variables{
      {"NAME", "name", [](const Description& it) -> Cell { return it.name; }},
      {"FAMILY", "family", [](const Description& it) { return family_of(it); }, Align::left,
       print::only_wide},
      {"TYPE", "", &type_of},
      {"", "type", &element_type_of},
      {"BYTES", "", &size_of, Align::right},
      {"MODE", "mode", &mode_of},
      {"", "size", &size_of},
      {"", "dimensions", &dimensions_of}};
  return variables;
}

const print::Listing<Reading>& readings_listing() {
  static const print::Listing<Reading> readings{
      {"NAME", "name", [](const Reading& it) -> Cell { return it.description.name; }},
      {"", "family", [](const Reading& it) { return family_of(it.description); }},
      {"TYPE", "", [](const Reading& it) { return type_of(it.description); }},
      {"", "type", [](const Reading& it) { return element_type_of(it.description); }},
      {"MODE", "mode", [](const Reading& it) { return mode_of(it.description); }, Align::left, 1},
      {"", "size", [](const Reading& it) { return size_of(it.description); }},
      {"", "dimensions", [](const Reading& it) { return dimensions_of(it.description); }},
      {"VALUE", "", [](const Reading& it) -> Cell { return text_of(it.elements, it.is_array); }},
      {"", "value", [](const Reading& it) -> Cell { return json_of(it.elements, it.is_array); }}};
  return readings;
}

}  // namespace millrace::tools::commands::vars
