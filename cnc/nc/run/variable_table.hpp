// Typed variables and arrays by name.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/nc/values/result.hpp"
#include "cnc/nc/variable_info.hpp"

namespace millrace::cnc::nc::run {

/// The parts of a name: "V.P.TABLE[2][0]" is V.P.TABLE and 2, 0.
struct ElementName {
  std::string_view variable;
  std::vector<long> indices;
};
[[nodiscard]] ElementName split_name(std::string_view name);

/// The largest STRING[n] (127 characters and a NUL, IB/tf527x_kernelv_api/402403595).
inline constexpr std::size_t longest_variable_string = 127;

class VariableTable {
 public:
  /// Creates a variable with these initial values (missing ones are 0 or ""). An existing one of
  /// the same shape keeps the values that `initial` does not replace; another shape is a fault.
  values::Result<void> declare(const std::string& name, const VariableShape& shape,
                               std::span<const Value> initial);
  [[nodiscard]] values::Result<Value> read(std::string_view name) const;
  /// Faults: 21460 and 21461 wrong type, 21462 too long, 21883 out of the type's range.
  values::Result<void> write(std::string_view name, const Value& value);
  [[nodiscard]] bool contains(std::string_view name) const;
  /// False if there is none.
  bool erase(std::string_view name);
  void clear();

  [[nodiscard]] std::size_t size() const { return variables_.size(); }
  [[nodiscard]] std::optional<VariableInfo> info(std::size_t index) const;
  [[nodiscard]] std::optional<VariableInfo> find(std::string_view name) const;

 private:
  struct Variable {
    VariableShape shape;
    std::vector<Value> elements;
  };
  [[nodiscard]] static values::Result<std::size_t> position(const Variable& variable,
                                                            const ElementName& name);
  std::map<std::string, Variable, std::less<>> variables_;
  /// Elements of all variables together, which are limited.
  std::size_t elements_ = 0;
};

}  // namespace millrace::cnc::nc::run
