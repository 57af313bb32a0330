// Requests for the variables of a controller, and their replies (idl/variables.idl).
//
//   VariableRequest request{.key = {"press", 1}, .names = {"V.E.LIMIT", "block_number"}};
//   VariableRequest change{.key = {"press", 1}, .action = VariableAction::write,
//                          .names = {"V.E.LIMIT"}, .values = {{"-3.5"}}};
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "fabric/data.hpp"

namespace millrace::fabric {

enum class VariableAction : std::uint8_t { read, write, list };

/// Limits of a request: names, bytes of a name, bytes of names and values together, and elements of
/// all values together.
inline constexpr std::size_t most_variables = 256;
inline constexpr std::size_t longest_variable = 255;
inline constexpr std::size_t most_variable_bytes = 65'536;
inline constexpr std::size_t most_variable_elements = 4'096;
/// Largest number of listed variables in one reply.
inline constexpr std::size_t variables_of_a_page = 64;

/// Nothing in it is checked: any process can send one.
struct VariableRequest {
  /// The requester; only it receives the reply.
  InstanceId requester{};
  /// A different one for each request.
  InstanceId token{};
  ChannelKey key{};
  VariableAction action = VariableAction::read;
  /// In CP1252. For a listing: the family.
  std::vector<std::string> names{};
  /// For a write: the elements of each name, as people write them; in CP1252.
  std::vector<std::vector<std::string>> values{};
  /// For a listing: the number of the first variable, counted from 0.
  std::uint32_t first = 0;
  /// How long the requester waits.
  std::chrono::nanoseconds patience{};
  /// The time since it was first sent.
  std::chrono::nanoseconds age{};
  std::string issuer{};
  Time at{};
  /// Which limit it exceeds, in words; then names and values are omitted. Only in a received
  /// request.
  std::string excess{};
  Extras extras{};
  bool operator==(const VariableRequest&) const = default;
};
MILLRACE_FIELDS(VariableRequest, requester, token, (key, .required = true), action, names, values,
                first, patience, age, issuer, at, (excess, .on_wire = false),
                (extras, .sparse = true))

struct VariableResult {
  Value value{};
  /// The controller's ADS error; 0 = none.
  std::uint32_t error = 0;
  bool writable = false;
  /// Size of the whole variable in bytes.
  std::uint32_t size = 0;
  /// Elements in each dimension; none = a scalar.
  std::vector<std::uint32_t> dimensions{};
  bool operator==(const VariableResult&) const = default;
};
MILLRACE_FIELDS(VariableResult, value, error, writable, size, dimensions)

struct VariableReply {
  InstanceId token{};
  bool done = false;
  /// The reason of a failure.
  Message reason{};
  /// One for each name, in order; of a listing the variables.
  std::vector<VariableResult> results{};
  /// For a write: the values before it.
  std::vector<Value> before{};
  /// For a listing: the number of variables in the family.
  std::uint32_t total = 0;
  Time at{};
  Extras extras{};
  bool operator==(const VariableReply&) const = default;
};
MILLRACE_FIELDS(VariableReply, token, done, reason, results, before, total, at,
                (extras, .sparse = true))

}  // namespace millrace::fabric
