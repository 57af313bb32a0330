#include "cnc/nc/run/system_data.hpp"

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

constexpr long fewest_elements = 3;  // documented

Result<void> carry_out_one(const AssignData& order, Environment& environment) {
  return environment.write(order.name, order.value);
}

Result<void> carry_out_one(const InitQueue& order, Environment& environment) {
  return environment.write(order.control + ".LastFilled", 1.0).and_then([&] {
    return environment.write(order.control + ".LastGet", 1.0);
  });
}

Result<void> carry_out_one(const WriteMessage& order, Environment& environment) {
  const auto filled = environment.read(order.control + ".LastFilled").and_then(values::integer);
  const auto got =
      filled ? environment.read(order.control + ".LastGet").and_then(values::integer) : filled;
  if (!got) {
    return tl::make_unexpected(got.error());
  }
  const auto elements = static_cast<long>(environment.elements(order.queue));
  const auto position = next_position({*filled, *got}, elements);
  if (!position) {
    return fault(position.error().id, "SSDQ: " + order.queue + position.error().text);
  }
  return environment.write(order.queue + '[' + std::to_string(*position) + ']', order.value)
      .and_then([&] {
        return environment.write(order.control + ".LastFilled", static_cast<double>(*position));
      });
}

}  // namespace

Result<long> next_position(const QueueControl& control, long elements) {
  if (elements < fewest_elements) {
    return fault(0, elements == 0 ? " is not an array of system data"
                                  : " has " + std::to_string(elements) +
                                        " elements; a queue needs at least 3");
  }
  const auto inside = [&](long index) { return index >= 1 && index <= elements; };
  if (!inside(control.last_filled) || !inside(control.last_get)) {
    return fault(0, ": LastFilled is " + std::to_string(control.last_filled) + " and LastGet " +
                        std::to_string(control.last_get) + ", its elements are 1 to " +
                        std::to_string(elements) + "; SSDQInit comes first");
  }
  const long next = control.last_filled == elements ? 1 : control.last_filled + 1;
  if (next == control.last_get) {
    return fault(0, " is full: no reader has taken its " + std::to_string(elements - 1) +
                        " messages; nothing is overwritten");
  }
  return next;
}

Result<void> carry_out(const DataOrder& order, Environment& environment) {
  return std::visit([&](const auto& request) { return carry_out_one(request, environment); },
                    order);
}

}  // namespace millrace::cnc::nc::run
