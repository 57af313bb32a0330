#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "cnc/nc/values/operations.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {
namespace {

// Reads the arguments of a string function in the required types; keeps the fault of the first
// wrong one.
class Reader {
 public:
  explicit Reader(Arguments arguments) : arguments_(arguments) {}

  std::string string() { return take(text(arguments_[next_]), std::string()); }
  long whole() { return take(integer(arguments_[next_]), 0L); }
  std::size_t count() { return static_cast<std::size_t>(std::max(whole(), 0L)); }
  double real() { return take(number(arguments_[next_]), 0.0); }
  [[nodiscard]] bool more() const { return next_ < arguments_.size(); }

  // The function's result, or the fault of its arguments.
  Result<Value> give(Value value) const {
    if (fault_.text.empty()) {
      return value;
    }
    return tl::make_unexpected(fault_);
  }

 private:
  template <class T>
  T take(const Result<T>& argument, T substitute) {
    ++next_;
    if (argument) {
      return *argument;
    }
    if (fault_.text.empty()) {
      fault_ = argument.error();
    }
    return substitute;
  }

  Arguments arguments_;
  std::size_t next_ = 0;
  Fault fault_;
};

Result<Value> left(Arguments arguments) {
  Reader read(arguments);
  const std::string string = read.string();
  return read.give(string.substr(0, read.count()));
}

Result<Value> right(Arguments arguments) {
  Reader read(arguments);
  const std::string string = read.string();
  const std::size_t count = std::min(read.count(), string.size());
  return read.give(string.substr(string.size() - count));
}

// MID["How are you?",3,5] = "are": count first, then the position, counted from 1.
Result<Value> middle(Arguments arguments) {
  Reader read(arguments);
  const std::string string = read.string();
  const std::size_t count = read.count();
  const std::size_t position = std::max<std::size_t>(read.count(), 1) - 1;
  return read.give(position < string.size() ? string.substr(position, count) : std::string());
}

Result<Value> length(Arguments arguments) {
  Reader read(arguments);
  return read.give(static_cast<double>(read.string().size()));
}

// ORD["text", position]; a position beyond the end is an error of the kernel with an unknown id.
Result<Value> code(Arguments arguments) {
  Reader read(arguments);
  const std::string string = read.string();
  const std::size_t position = read.more() ? read.count() : 1;
  if (!string.empty() && (position < 1 || position > string.size())) {
    return fault(0,
                 "ORD: the string \"" + string + "\" has no character " + std::to_string(position));
  }
  const char first = string.empty() ? '\0' : string[position - 1];
  return read.give(static_cast<double>(static_cast<unsigned char>(first)));
}

Result<Value> character(Arguments arguments) {
  Reader read(arguments);
  const long number = read.whole();
  if (number < 1 || number > 255) {
    return fault(21459, "CHR takes a character code from 1 to 255, not " + std::to_string(number));
  }
  return read.give(std::string(1, static_cast<char>(number)));
}

// FIND["text","part"]: position from 1, 0 if the part is not found.
Result<Value> find(Arguments arguments) {
  Reader read(arguments);
  const std::string string = read.string();
  const std::size_t position = string.find(read.string());
  return read.give(position == std::string::npos ? 0.0 : static_cast<double>(position + 1));
}

// DELETE["text", count, position]
Result<Value> remove(Arguments arguments) {
  Reader read(arguments);
  std::string string = read.string();
  const std::size_t count = read.count();
  const std::size_t position = std::max<std::size_t>(read.count(), 1) - 1;
  if (position < string.size()) {
    string.erase(position, count);
  }
  return read.give(string);
}

// REPLACE["text","new",count,position]: replaces count characters from the position.
Result<Value> replace(Arguments arguments) {
  Reader read(arguments);
  std::string string = read.string();
  const std::string insertion = read.string();
  const std::size_t count = read.count();
  const std::size_t position = std::max<std::size_t>(read.count(), 1) - 1;
  if (position <= string.size()) {
    string.replace(position, count, insertion);
  }
  return read.give(string);
}

// INSERT["text","new",position]: inserts the new characters after the position.
Result<Value> insert(Arguments arguments) {
  Reader read(arguments);
  std::string string = read.string();
  const std::string insertion = read.string();
  string.insert(std::min(read.count(), string.size()), insertion);
  return read.give(string);
}

Result<Value> integer_to_string(Arguments arguments) {
  Reader read(arguments);
  return read.give(std::to_string(read.whole()));
}

Result<Value> real_to_string(Arguments arguments) {
  Reader read(arguments);
  return read.give(display(read.real()));
}

std::string_view trimmed(std::string_view string) {
  const std::size_t first = string.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return {};
  }
  string.remove_prefix(first);
  string.remove_suffix(string.size() - 1 - string.find_last_not_of(" \t"));
  if (string.starts_with('+')) {
    string.remove_prefix(1);  // from_chars takes no plus sign
  }
  return string;
}

template <class T>
Result<Value> parsed(Arguments arguments, int id, const char* what) {
  Reader read(arguments);
  const std::string string = read.string();
  const std::string_view digits = trimmed(string);
  T number{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (!read.give(0.0)) {
    return read.give(0.0);
  }
  if (error != std::errc{} || end != digits.data() + digits.size() ||
      !std::isfinite(static_cast<double>(number))) {
    return fault(id, "the string \"" + string + "\" is not " + what);
  }
  return static_cast<double>(number);
}

Result<Value> string_to_integer(Arguments arguments) {
  return parsed<long>(arguments, 21464, "an integer");
}

Result<Value> string_to_real(Arguments arguments) {
  return parsed<double>(arguments, 21465, "a real number");
}

constexpr std::array<Function, 14> string_table = {{
    {"LEFT", 2, 2, left},
    {"MID", 3, 3, middle},
    {"RIGHT", 2, 2, right},
    {"LEN", 1, 1, length},
    {"ORD", 1, 2, code},
    {"CHR", 1, 1, character},
    {"FIND", 2, 2, find},
    {"DELETE", 3, 3, remove},
    {"REPLACE", 4, 4, replace},
    {"INSERT", 3, 3, insert},
    {"INT_TO_STR", 1, 1, integer_to_string},
    {"REAL_TO_STR", 1, 1, real_to_string},
    {"STR_TO_INT", 1, 1, string_to_integer},
    {"STR_TO_REAL", 1, 1, string_to_real},
}};

}  // namespace

std::span<const Function> string_functions() {
  return string_table;
}

}  // namespace millrace::cnc::nc::values
