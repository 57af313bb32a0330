// Which connection a full server gives up for a new one.
//
//   const auto given_up = most_dispensable(half_open, [](const Peer& one) { return one.address; });
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <vector>

namespace millrace::base::loop {

/// The first of the address that has the most: an address that shuts others out closes its own.
/// `candidates` begin with the most dispensable; null if there are none.
template <class Candidate>
std::shared_ptr<Candidate> most_dispensable(
    const std::vector<std::shared_ptr<Candidate>>& candidates, const auto& address_of) {
  std::map<decltype(address_of(*candidates.front())), std::size_t> counts;
  for (const auto& one : candidates) {
    ++counts[address_of(*one)];
  }
  const auto found = std::ranges::max_element(
      candidates, {}, [&](const auto& one) { return counts.at(address_of(*one)); });
  return found == candidates.end() ? nullptr : *found;
}

}  // namespace millrace::base::loop
