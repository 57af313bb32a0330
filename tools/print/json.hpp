// Values of the fabric in JSON, the same in every `--json`.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/messages.hpp"
#include "fabric/plant/concern.hpp"
#include "fabric/shape.hpp"

namespace millrace::tools::print {

/// ISO 8601 in UTC; nothing if the time is not known.
void put_time(boost::json::object& out, std::string_view name, fabric::Time time);

/// The text of a sentence; and if it has a code, NAME_code, and NAME_arguments, each a text or
/// {"code", "arguments", "text"}.
void put_message(boost::json::object& out, std::string_view name, const fabric::Message& message);

/// The fields of a value by the names of its list. A withheld text is its size.
void put_shape(boost::json::object& out, fabric::Shape shape, const void* value,
               const std::optional<std::uint32_t>& withheld = {});
template <fabric::HasFields Value>
void put_fields(boost::json::object& out, const Value& value,
                const std::optional<std::uint32_t>& withheld = {}) {
  put_shape(out, fabric::shape_of<Value>(), &value, withheld);
}
/// Each name that put_shape has for one of them, whatever the value.
std::vector<std::string> names_of(fabric::Shape shape);

/// As in `millrace channels --json`.
boost::json::object json_of(const fabric::ChannelStatus& status);
/// As in `millrace services --json`.
boost::json::object json_of(const fabric::InstanceIdentity& identity,
                            const std::optional<fabric::InstanceStatus>& status);
/// {kind, level, who, subject, machines, channels, uuid, since, what, why, todo, cause}; what is
/// empty is left out.
boost::json::object json_of(const fabric::plant::Concern& concern);
boost::json::array json_of(const std::vector<fabric::plant::Concern>& concerns);
/// Steps: each {text}, with text_code and text_arguments.
boost::json::array json_of(const std::vector<fabric::Message>& steps);
/// A text of the controller: CP1252 as UTF-8.
std::string text_json(std::string_view cp1252);
/// A text of the fabric; bytes that are not UTF-8 are taken as CP1252, so that the output is JSON.
std::string utf8(std::string_view text);

/// The text of a value, with numbers as people write them: 10 and 0.1, where Boost.JSON's own text
/// has 1E1 and 1E-1. An invalid one is null.
std::string json_text(const boost::json::value& value);

/// One line to standard output.
void print_json(const boost::json::value& value);

}  // namespace millrace::tools::print
