#include "gateway/queues/ring.hpp"

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::queues {

base::messages::Message wrong_with(const Control& control) {
  if (control.elements < fewest_elements || control.elements > most_elements) {
    return base::messages::queue_of_elements(control.elements, fewest_elements, most_elements);
  }
  const auto wrong = [&](std::int64_t index) { return index < 1 || index > control.elements; };
  if (wrong(control.last_filled) || wrong(control.last_get)) {
    return base::messages::queue_indices_wrong(control.last_filled, control.last_get,
                                               control.elements);
  }
  return {};
}

std::uint32_t steps(std::uint32_t from, std::uint32_t to, std::uint32_t elements) {
  return to >= from ? to - from : elements - from + to;
}

std::uint32_t filled(const Control& control) {
  return steps(static_cast<std::uint32_t>(control.last_get),
               static_cast<std::uint32_t>(control.last_filled), control.elements);
}

std::vector<std::uint32_t> elements_after(const Control& control, std::uint32_t from) {
  std::vector<std::uint32_t> found;
  const auto count = steps(from, static_cast<std::uint32_t>(control.last_filled), control.elements);
  std::uint32_t element = from;
  for (std::uint32_t i = 0; i < count; ++i) {
    element = element % control.elements + 1;
    found.push_back(element);
  }
  return found;
}

bool holds(const Control& control, std::uint32_t element) {
  return element >= 1 && element <= control.elements &&
         steps(static_cast<std::uint32_t>(control.last_get), element, control.elements) <=
             filled(control);
}

}  // namespace millrace::gateway::queues
