#include "base/configuration/check.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "idl/check.pb.h"

namespace millrace::base::configuration {

namespace {

using config::Check;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

const Check& options_of(const FieldDescriptor& field) {
  return field.options().GetExtension(config::is);
}

bool is_text(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_STRING;
}

bool is_double(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
}

bool has_form(std::string_view value, Check::Form form) {
  switch (form) {
    case Check::TEXT:
      return text::is_utf8(value);
    case Check::LINE:
      return text::is_utf8(value) && std::ranges::none_of(value, text::is_control);
    case Check::WORD:
      return std::ranges::all_of(value, [](char c) { return c > ' ' && c <= '~'; });
    case Check::NAME:
      return std::ranges::all_of(
          value, [](char c) { return text::is_alphanumeric(c) || c == '_' || c == '-'; });
    case Check::SYMBOL:
      return std::ranges::all_of(value,
                                 [](char c) { return text::is_alphanumeric(c) || c == '_'; });
    case Check::UUID:
      return !text::trim(value).empty() && std::ranges::none_of(value, [](char c) {
        return text::is_control(c) || c == '*' || c == '?';
      });
    default:
      return true;
  }
}

std::string_view noun_of(Check::Form form) {
  switch (form) {
    case Check::TEXT:
      return "bytes of UTF-8";
    case Check::LINE:
      return "bytes of UTF-8 without control characters";
    case Check::WORD:
      return "ASCII characters without blanks";
    case Check::NAME:
      return "letters, digits, '_' and '-'";
    case Check::SYMBOL:
      return "letters, digits and '_'";
    case Check::UUID:
      return "bytes, the UUID of a service";
    default:
      return "bytes";
  }
}

/// Of a number, or of the bytes of a text.
struct Limits {
  double least;
  double most;
};

Limits limits_of(const FieldDescriptor& field) {
  const Check& is = options_of(field);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double least = is_double(field) ? -infinity : is.form() >= Check::WORD ? 1 : 0;
  return {is.has_least() ? is.least() : least, is.has_most() ? is.most() : infinity};
}

/// "1 to 255 ms", "at most 200 bytes"; empty if the options require nothing.
std::string expectation(const FieldDescriptor& field) {
  const Check& is = options_of(field);
  const auto [least, most] = limits_of(field);
  std::string range;
  if (std::isfinite(most)) {
    range = std::isfinite(least) && (least > 0 || !is_text(field))
                ? fmt::format("{} to {}", least, most)
                : fmt::format("at most {}", most);
  } else if (least > 0 || is.has_least()) {
    range = fmt::format("{} or more", least);
  }
  const std::string_view noun = is_text(field) ? noun_of(is.form()) : is.unit();
  if (noun.empty() || (range.empty() && is.form() == Check::ANY)) {
    return range;
  }
  return range.empty() ? std::string(noun) : fmt::format("{} {}", range, noun);
}

std::string example_of(const FieldDescriptor& field) {
  const std::string& example = options_of(field).example();
  return is_text(field) ? fmt::format("\"{}\"", example) : example;
}

std::string missing(const FieldDescriptor& field) {
  if (options_of(field).has_example()) {
    return fmt::format("is missing; expected {}: {}", field.name(), example_of(field));
  }
  const std::string expected = expectation(field);
  return expected.empty() ? "is missing" : fmt::format("is missing; expected {}", expected);
}

/// The value of a text or number as text; `index` is that in a list.
std::string value_of(const Message& message, const FieldDescriptor& field, int index) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (is_text(field)) {
    return field.is_repeated() ? reflection.GetRepeatedString(message, &field, index)
                               : reflection.GetString(message, &field);
  }
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(message, &field,
                                                        field.is_repeated() ? index : -1, &text);
  return text;
}

std::string shown(const FieldDescriptor& field, const std::string& value) {
  return is_text(field) ? fmt::format("\"{}\"", value) : value;
}

/// NaN is outside.
bool is_inside(const FieldDescriptor& field, const std::string& value) {
  auto size = static_cast<double>(value.size());
  if (!is_text(field)) {
    std::from_chars(value.data(), value.data() + value.size(), size);
  }
  const auto [least, most] = limits_of(field);
  return size >= least && size <= most && std::isfinite(size);
}

class Checker {
 public:
  explicit Checker(Mistakes& mistakes) : mistakes_(mistakes) {}

  void check_all(const Message& message, const ConfigPath& path) {
    const google::protobuf::Descriptor& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      check_field(message, *type.field(i), path);
    }
  }

 private:
  /// Values that occur once, with their field and that of `per`.
  using Seen = std::set<std::tuple<const FieldDescriptor*, std::string, std::string>>;

  void check_field(const Message& message, const FieldDescriptor& field, const ConfigPath& path) {
    const google::protobuf::Reflection& reflection = *message.GetReflection();
    const Check& is = options_of(field);
    const bool is_list = field.is_repeated();
    const bool has = !is_list && reflection.HasField(message, &field);
    const int size = is_list ? reflection.FieldSize(message, &field) : static_cast<int>(has);
    mistakes_.expect(size > 0 || !is.required(), path / field.name(), missing(field));
    const int most = is.has_at_most() ? static_cast<int>(is.at_most()) : size;
    mistakes_.expect(size <= most, path / ConfigStep{field.name(), most},
                     fmt::format("there are {}; expected at most {}", size, most));
    Seen seen;
    for (int i = 0; i < size; ++i) {
      const ConfigPath here = path / ConfigStep{field.name(), i};
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        const Message& block = is_list ? reflection.GetRepeatedMessage(message, &field, i)
                                       : reflection.GetMessage(message, &field);
        check_all(block, here);
        check_once_in(block, here, seen);
      } else {
        check_value(field, value_of(message, field, i), here);
        if (is_list && is.once()) {
          check_once(field, value_of(message, field, i), "", here, seen);
        }
      }
    }
  }

  void check_value(const FieldDescriptor& field, const std::string& value, const ConfigPath& path) {
    const Check& is = options_of(field);
    if (is_text(field) && value.empty() && is.required()) {
      mistakes_.expect(false, path, missing(field));
    } else if (is_text(field) || is_double(field) || is.has_least() || is.has_most()) {
      mistakes_.expect(is_inside(field, value) && (!is_text(field) || has_form(value, is.form())),
                       path,
                       fmt::format("{}; expected {}{}", shown(field, value), expectation(field),
                                   is.has_example() ? ", as in " + example_of(field) : ""));
    }
  }

  void check_once_in(const Message& block, const ConfigPath& path, Seen& seen) {
    const google::protobuf::Descriptor& type = *block.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      const Check& is = options_of(field);
      if (is.once() && !field.is_repeated() &&
          (field.has_default_value() || block.GetReflection()->HasField(block, &field))) {
        const FieldDescriptor* const other = type.FindFieldByName(is.per());
        const std::string per =
            other != nullptr ? fmt::format(" with {}: {}", is.per(), value_of(block, *other, 0))
                             : "";
        check_once(field, value_of(block, field, 0), per, path / field.name(), seen);
      }
    }
  }

  void check_once(const FieldDescriptor& field, const std::string& value, const std::string& per,
                  const ConfigPath& path, Seen& seen) {
    mistakes_.expect(seen.emplace(&field, value, per).second, path,
                     fmt::format("{} occurs twice{}", shown(field, value), per));
  }

  Mistakes& mistakes_;
};

}  // namespace

void check(const Message& config, Mistakes& mistakes) {
  Checker(mistakes).check_all(config, {});
}

}  // namespace millrace::base::configuration
