// The ring of a message queue: elements 1 to n; those after LastGet up to LastFilled hold messages,
// in order and across the end of the array (documented, DOK-MTX***-NC*F*EX*V13, p. 655; that they
// count from 1 is inferred).
//
//   control = {.last_filled = 1, .last_get = 2, .elements = 3}
//   elements_after(control, control.last_get)               // 3, 1
#pragma once

#include <cstdint>
#include <vector>

#include "base/messages/message.hpp"

namespace millrace::gateway::queues {

/// The control structure, as it was read in one question, and the size of the array.
struct Control {
  std::int64_t last_filled = 1;
  std::int64_t last_get = 1;
  std::uint32_t elements = 0;
  bool operator==(const Control&) const = default;
};

/// The array of a queue has three elements at least (documented); the most is our choice.
inline constexpr std::uint32_t fewest_elements = 3;
inline constexpr std::uint32_t most_elements = 10'000;

/// An impossible value: an index outside of the elements, a queue that is too small. Empty if there
/// is none; a phrase that follows the name of the queue.
[[nodiscard]] base::messages::Message wrong_with(const Control& control);

/// Steps from one element to another, forwards over the end: 0 to elements - 1.
[[nodiscard]] std::uint32_t steps(std::uint32_t from, std::uint32_t to, std::uint32_t elements);

/// Messages that stand in the queue. `control` is right.
[[nodiscard]] std::uint32_t filled(const Control& control);

/// The elements behind `from` up to LastFilled, in the order of their messages.
[[nodiscard]] std::vector<std::uint32_t> elements_after(const Control& control, std::uint32_t from);

/// `element` is LastGet or one behind it that holds a message.
[[nodiscard]] bool holds(const Control& control, std::uint32_t element);

}  // namespace millrace::gateway::queues
