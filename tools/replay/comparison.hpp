// Whether an answer is the recorded one. Pure.
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

/// How far a number in an answer may be from the recorded one.
struct Tolerance {
  double value = 0;
  /// Of the recorded number's size, not of the number itself.
  bool relative = false;
};

class Tolerances {
 public:
  /// "UUID=0.001", "UUID=0.1%", or without UUID for all services that have none of their own. The
  /// error says what was expected.
  tl::expected<void, std::string> add(std::string_view text);
  /// Nothing if the answers of this service must be exact.
  [[nodiscard]] std::optional<Tolerance> of(const std::string& uuid) const;

 private:
  std::optional<Tolerance> for_all_;
  /// By canonical UUID.
  std::map<std::string, Tolerance> by_uuid_;
};

struct Difference {
  /// In words: "the text differs", "the state differs".
  std::string what{};
  /// The first byte of the texts that differs.
  std::optional<std::size_t> at{};
};

/// With a tolerance the numbers of the texts are compared as numbers and everything between them
/// byte by byte; the states must always be the same. Of a text that is not recorded the size is
/// compared, unless there is a tolerance.
std::optional<Difference> compare(const Answer& recorded, const Answer& got,
                                  const std::optional<Tolerance>& tolerance);

}  // namespace millrace::tools::replay
