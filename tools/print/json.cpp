#include "tools/print/json.hpp"

#include <algorithm>
#include <cmath>

#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>
#include <fmt/format.h>

#include "base/text/controls.hpp"
#include "base/text/cp1252.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/print/data.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using fabric::as;
using fabric::Kind;
using fabric::Leaf;

std::string escaped(std::uint32_t control) {
  constexpr std::string_view names{"btn\0fr", 6};
  const std::uint32_t i = control - '\b';
  const bool has_name = i < names.size() && names[i] != '\0';
  return has_name ? std::string{'\\', names[i]} : fmt::format("\\u{:04x}", control);
}

/// Control characters are escaped: JSON is also read at terminals. Other readers get the same text.
void append_string(std::string& text, std::string_view content) {
  const bool is_plain = std::ranges::all_of(content, [](char letter) {
    return letter >= ' ' && letter < '\x7f' && letter != '"' && letter != '\\';
  });
  text += '"';
  if (is_plain) {
    text += content;
  } else {
    for (std::size_t i = 0; i < content.size(); ++i) {
      const char letter = content[i];
      if (const auto control = base::text::control_at(content.substr(i))) {
        text += escaped(control->code);
        i += control->size - 1;
      } else {
        text += letter == '"' || letter == '\\' ? "\\" : "";
        text += letter;
      }
    }
  }
  text += '"';
}

void append(std::string& text, const boost::json::value& value) {
  if (const auto* const array = value.if_array()) {
    text += '[';
    for (const boost::json::value& each : *array) {
      text += &each == array->data() ? "" : ",";
      append(text, each);
    }
    text += ']';
  } else if (const auto* const object = value.if_object()) {
    text += '{';
    bool first = true;
    for (const auto& [key, each] : *object) {
      text += first ? "" : ",";
      append_string(text, key);
      text += ':';
      append(text, each);
      first = false;
    }
    text += '}';
  } else if (const auto* const string = value.if_string()) {
    append_string(text, *string);
  } else if (const auto* const number = value.if_double()) {
    text += std::isfinite(*number) ? fmt::format("{}", *number) : "null";
  } else {
    text += boost::json::serialize(value);
  }
}

constexpr std::string_view withheld_text = "text";
constexpr std::string_view withheld_size = "text_size";

bool is_call(const Leaf& leaf) {
  return leaf.shape == &fabric::shape_of<fabric::CallId>;
}
bool is_key(const Leaf& leaf) {
  return leaf.shape == &fabric::shape_of<fabric::ChannelKey>;
}

std::string name_of(const Leaf& leaf) {
  const std::string name(leaf.options.json.empty() ? leaf.name : leaf.options.json);
  const bool is_duration = leaf.kind == Kind::nanoseconds || leaf.kind == Kind::milliseconds;
  return is_duration ? name + "_ms" : name;
}

bool is_empty(const Leaf& leaf, const void* member) {
  switch (leaf.kind) {
    case Kind::text:
      return as<std::string>(member).empty();
    case Kind::message:
      return as<fabric::Message>(member).empty();
    case Kind::list:
      return leaf.size(member) == 0;
    default:
      return number_of(leaf.kind, member) == 0;
  }
}

/// Its text, or for a sentence with a code all of it.
boost::json::value json_of_argument(const fabric::Message& message) {
  if (message.code.empty()) {
    return boost::json::string(utf8(message.text));
  }
  boost::json::array arguments;
  for (const fabric::Message& argument : message.arguments) {
    arguments.push_back(json_of_argument(argument));
  }
  return boost::json::object{
      {"code", message.code}, {"arguments", std::move(arguments)}, {"text", utf8(message.text)}};
}

constexpr std::string_view code_suffix = "_code";
constexpr std::string_view arguments_suffix = "_arguments";

template <typename T>
boost::json::value unless_zero(const void* member) {
  const T& id = as<T>(member);
  return id == T{} ? boost::json::value(nullptr) : boost::json::string(id.to_string());
}

/// Null: nothing is known.
boost::json::value json_of_leaf(const Leaf& leaf, Kind kind, const void* member) {
  switch (kind) {
    case Kind::boolean:
      return as<bool>(member);
    case Kind::word:
      return boost::json::string(leaf.word(as<std::uint8_t>(member)));
    case Kind::time: {
      const auto time = as<fabric::Time>(member);
      return time == fabric::Time{} ? boost::json::value(nullptr)
                                    : boost::json::string(time_text(time));
    }
    case Kind::nanoseconds:
      return std::chrono::duration<double, std::milli>(as<std::chrono::nanoseconds>(member))
          .count();
    case Kind::id:
      return unless_zero<fabric::InstanceId>(member);
    case Kind::shape:
      if (leaf.shape == &fabric::shape_of<fabric::Extra>) {
        boost::json::object extra;
        put_fields(extra, as<fabric::Extra>(member));
        return extra;
      }
      return is_call(leaf) ? unless_zero<fabric::CallId>(member)
                           : json_of(as<fabric::Value>(member));
    case Kind::text: {
      const auto& text = as<std::string>(member);
      return boost::json::string(leaf.options.cp1252 ? text_json(text) : utf8(text));
    }
    case Kind::scope:
      return boost::json::string(
          utf8(fabric::format_channel_scope(as<fabric::ChannelScope>(member))));
    case Kind::maybe_i64: {
      const auto& number = as<std::optional<std::int64_t>>(member);
      return number ? boost::json::value(*number) : nullptr;
    }
    default: {
      const std::uint64_t number = number_of(kind, member);
      return leaf.options.hex ? boost::json::value(fmt::format("{:x}", number))
                              : boost::json::value(number);
    }
  }
}

boost::json::value json_of_leaf(const Leaf& leaf, const void* member) {
  if (leaf.kind != Kind::list) {
    return json_of_leaf(leaf, leaf.kind, member);
  }
  boost::json::array all;
  for (std::size_t i = 0; i < leaf.size(member); ++i) {
    all.push_back(json_of_leaf(leaf, leaf.element, leaf.get(member, i)));
  }
  return all;
}

}  // namespace

void put_time(boost::json::object& out, std::string_view name, fabric::Time time) {
  if (time != fabric::Time{}) {
    out[name] = time_text(time);
  }
}

void put_message(boost::json::object& out, std::string_view name, const fabric::Message& message) {
  out[name] = utf8(message.text);
  if (!message.code.empty()) {
    boost::json::object whole = json_of_argument(message).as_object();
    out[std::string(name) + std::string(code_suffix)] = std::move(whole["code"]);
    out[std::string(name) + std::string(arguments_suffix)] = std::move(whole["arguments"]);
  }
}

void put_shape(boost::json::object& out, fabric::Shape shape, const void* value,
               const std::optional<std::uint32_t>& withheld) {
  for (const Leaf& leaf : shape) {
    const void* const member = leaf.at(value);
    const std::string name = name_of(leaf);
    if (!leaf.options.observed || (leaf.options.sparse && is_empty(leaf, member))) {
      continue;
    }
    if (is_key(leaf)) {
      if (!as<fabric::ChannelKey>(member).machine.empty()) {
        put_shape(out, leaf.shape(), member);
      }
    } else if (leaf.kind == Kind::shape && !is_call(leaf)) {
      put_shape(out, leaf.shape(), member, withheld);
    } else if (leaf.kind == Kind::text && name == withheld_text && withheld) {
      out[withheld_size] = *withheld;
    } else if (leaf.kind == Kind::message) {
      put_message(out, name, as<fabric::Message>(member));
    } else if (auto json = json_of_leaf(leaf, member); !json.is_null()) {
      out[name] = std::move(json);
    }
  }
}

std::vector<std::string> names_of(fabric::Shape shape) {
  std::vector<std::string> names;
  for (const Leaf& leaf : shape) {
    if (leaf.kind == Kind::shape && !is_call(leaf)) {
      const std::vector<std::string> inner = names_of(leaf.shape());
      names.insert(names.end(), inner.begin(), inner.end());
    } else if (leaf.options.observed) {
      const std::string name = name_of(leaf);
      names.push_back(name);
      if (leaf.kind == Kind::text && name == withheld_text) {
        names.emplace_back(withheld_size);
      }
      if (leaf.kind == Kind::message) {
        names.push_back(name + std::string(code_suffix));
        names.push_back(name + std::string(arguments_suffix));
      }
    }
  }
  return names;
}

boost::json::object json_of(const fabric::ChannelStatus& status) {
  boost::json::object out;
  put_fields(out, status);
  return out;
}

boost::json::object json_of(const fabric::InstanceIdentity& identity,
                            const std::optional<fabric::InstanceStatus>& status) {
  boost::json::object out;
  put_fields(out, identity);
  if (status) {
    put_fields(out, *status);
  }
  return out;
}

std::string text_json(std::string_view cp1252) {
  return base::text::to_utf8(cp1252);
}

std::string utf8(std::string_view text) {
  return base::text::is_utf8(text) ? std::string(text) : base::text::to_utf8(text);
}

std::string json_text(const boost::json::value& value) {
  std::string text;
  append(text, value);
  return text;
}

void print_json(const boost::json::value& value) {
  fmt::print("{}\n", json_text(value));
}

boost::json::object json_of(const fabric::plant::Concern& concern) {
  boost::json::object out{{"kind", name_of(concern.kind)},
                          {"level", name_of(concern.level)},
                          {"who", name_of(concern.who)}};
  put_message(out, "subject", subject_of(concern));
  if (!concern.machines.empty()) {
    boost::json::array machines;
    for (const std::string& machine : concern.machines) {
      machines.emplace_back(utf8(machine));
    }
    out["machines"] = std::move(machines);
  }
  if (!concern.channels.empty()) {
    boost::json::array channels;
    for (const fabric::ChannelKey& key : concern.channels) {
      channels.push_back(
          boost::json::object{{"machine", utf8(key.machine)}, {"channel", key.channel}});
    }
    out["channels"] = std::move(channels);
  }
  if (!concern.uuid.empty()) {
    out["uuid"] = utf8(concern.uuid);
  }
  put_time(out, "since", concern.since);
  put_message(out, "what", concern.what);
  if (!concern.why.empty()) {
    put_message(out, "why", concern.why);
  }
  out["todo"] = json_of(concern.todo);
  out["cause"] = utf8(concern.cause);
  return out;
}

boost::json::array json_of(const std::vector<fabric::Message>& steps) {
  boost::json::array out;
  for (const fabric::Message& step : steps) {
    boost::json::object each;
    put_message(each, "text", step);
    out.push_back(std::move(each));
  }
  return out;
}

boost::json::array json_of(const std::vector<fabric::plant::Concern>& concerns) {
  boost::json::array out;
  for (const fabric::plant::Concern& concern : concerns) {
    out.push_back(json_of(concern));
  }
  return out;
}

}  // namespace millrace::tools::print
