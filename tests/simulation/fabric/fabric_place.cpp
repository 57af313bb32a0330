// The state of the fabric's ends as text.
#include <fmt/ranges.h>

#include "tests/simulation/fabric/fabric.hpp"

namespace millrace::tests::simulation {

std::string Fabric::place_of(EndNumber number) const {
  const End& end = *ends_[number];
  return end.gateway != nullptr ? place_of_gateway(end, number) : place_of_instance(end, number);
}

std::string Fabric::place_of_gateway(const End& end, EndNumber number) const {
  std::string words = fmt::format("{} {}", end.discovery_due, end.registry_knows);
  for (const auto& [key, reply] : end.replies_in) {
    words += fmt::format("|{} {} {} {} {}", reply.instance.to_string(), reply.call.to_string(),
                         reply.attempt, reply.state, reply.text);
  }
  for (const auto& [uuid, writer] : end.requests) {
    words += "|" + uuid.to_string();
  }
  for (const PairPointer& pair : pairs_of(number)) {
    const Side& side = pair->of_instance;
    words += fmt::format("|{} {} {} {} {} {} {}", side.path, side.heard, side.reader, side.writer,
                         side.epoch, pair->replies, pair->replies_due);
  }
  return words;
}

std::string Fabric::place_of_instance(const End& end, EndNumber number) const {
  std::string words = fmt::format("{} {}", end.drain_due, end.replies.last);
  for (const auto& [key, cached] : end.requests_in) {
    words += fmt::format("|{} {} {} {} {}", key.epoch, static_cast<int>(cached.instance_state),
                         cached.value.call.to_string(), cached.value.attempt,
                         cached.value.assigned.to_string());
  }
  for (const auto& [key, gateways] : end.requested_by) {
    words += fmt::format("|{} {}", key.epoch, fmt::join(gateways, ","));
  }
  for (const PairPointer& pair : pairs_of(number)) {
    const Side& side = pair->of_gateway;
    words += fmt::format("|{} {} {} {} {} {} {}", side.path, side.heard, side.reader, side.writer,
                         side.epoch, pair->requests, pair->requests_due);
  }
  return words;
}

}  // namespace millrace::tests::simulation
