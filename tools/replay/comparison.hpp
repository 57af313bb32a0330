// Compares a response with the recorded one. Pure.
//
//   Tolerances tolerances;
//   tolerances.add("560aacbf-…=0.1%");
//   if (const auto difference = compare(recorded, answer, tolerances.of(uuid))) …
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

/// How far a number in a response may be from the recorded one.
struct Tolerance {
  double value = 0;
  /// `value` is a share of the recorded number.
  bool relative = false;
};

class Tolerances {
 public:
  /// "UUID=0.001", "UUID=0.1%", or without UUID for all services that have none of their own. The
  /// error names what was expected.
  tl::expected<void, std::string> add(std::string_view text);
  /// Nothing if the responses of this service must be exact.
  [[nodiscard]] std::optional<Tolerance> of(const std::string& uuid) const;

 private:
  std::optional<Tolerance> for_all_;
  /// By canonical UUID.
  std::map<std::string, Tolerance> by_uuid_;
};

struct Difference {
  /// "the text differs", "the state differs".
  std::string what{};
  /// The first byte of the texts that differs.
  std::optional<std::size_t> at{};
};

/// With a tolerance, the numbers of the texts are compared as numbers and the rest byte by byte;
/// the states must always be equal. If the recording leaves a text out, its size is compared,
/// unless there is a tolerance.
std::optional<Difference> compare(const Answer& recorded, const Answer& got,
                                  const std::optional<Tolerance>& tolerance);

}  // namespace millrace::tools::replay
