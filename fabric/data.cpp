#include "fabric/data.hpp"

#include <algorithm>
#include <variant>
#include <vector>

#include "fabric/channel_scope.hpp"

namespace millrace::fabric {

bool is_queue(const DataSample& sample) {
  return sample.group == queue_group && !queue_of(sample.key.machine).empty();
}

const Value* value_of(const DataSample& sample, std::string_view name) {
  const auto found = std::ranges::find(sample.values, name, &Value::name);
  return found == sample.values.end() ? nullptr : &*found;
}

std::optional<std::int64_t> number_of(const DataSample& sample, std::string_view name) {
  const Value* const value = value_of(sample, name);
  const auto* numbers =
      value == nullptr ? nullptr : std::get_if<std::vector<std::int64_t>>(&value->elements);
  return numbers == nullptr || numbers->empty() ? std::nullopt : std::optional(numbers->front());
}

std::optional<Filled> filled_of(const DataSample& sample) {
  const auto elements = number_of(sample, "elements");
  const auto filled = number_of(sample, "last_filled");
  const auto got = number_of(sample, "last_get");
  const auto inside = [&](const auto& index) {
    return index && *index >= 1 && *index <= *elements;
  };
  if (!elements || !inside(filled) || !inside(got)) {
    return std::nullopt;
  }
  const std::int64_t ahead = *filled - *got;
  return Filled{ahead < 0 ? ahead + *elements : ahead, *elements - 1};
}

}  // namespace millrace::fabric
