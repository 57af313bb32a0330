// What an NC program can access outside itself: variables of the controller and other programs. The
// virtual CNC implements it; tests use a map.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <tl/expected.hpp>

namespace millrace::cnc::nc {

/// A value of the NC language: a number (REAL64 represents every integer type exactly) or a string
/// in CP1252.
using Value = std::variant<double, std::string>;

/// An error of the kernel: its id if the vendor documents one, otherwise 0, and a text.
struct Fault {
  int id = 0;
  std::string text;
};

class Environment {
 public:
  virtual ~Environment() = default;

  /// Reads a variable outside the interpreter (V.G., V.A., V.E., system data: SD.), by its full
  /// name.
  virtual tl::expected<Value, Fault> read(std::string_view name) = 0;
  /// Writes such a variable; a string longer than the variable is fault 21462.
  virtual tl::expected<void, Fault> write(std::string_view name, const Value& value) = 0;
  /// True if this external variable (V.E.NAME, without indices) is synchronous: the channel then
  /// runs empty before a block that uses it, which is the vendor's default
  /// (IB/tf5200_external_variables/112461195).
  virtual bool synchronous(std::string_view /*name*/) { return true; }
  /// Number of elements of an array of system data (SD.NAME), counted from 1; 0 if it is not an
  /// array.
  virtual std::size_t elements(std::string_view /*name*/) { return 0; }
  /// #INIT: sets an external variable, an element of one, or a whole array to zero or ""
  /// (IB/tf5200_programming_manual/207988747, documented).
  virtual tl::expected<void, Fault> initialise(std::string_view name) {
    return read(name).and_then([&](const Value& value) {
      return write(name, std::holds_alternative<double>(value) ? Value(0.0) : Value(std::string()));
    });
  }
  /// The text of a global subprogram or cycle, by the name in the program.
  virtual tl::expected<std::string, Fault> load(std::string_view program) = 0;
};

// The cycles of this library, written in NC: cnc/nc/cycles/*.cyc.

/// The text of a cycle by its file name ("SysServiceWait.cyc", case-insensitive); nullopt if the
/// library does not have it.
[[nodiscard]] std::optional<std::string_view> shipped_cycle(std::string_view name);

}  // namespace millrace::cnc::nc
