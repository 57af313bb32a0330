#include "tests/cluster/network/switch.hpp"

#include <string_view>

namespace millrace::tests::cluster {

namespace {

constexpr std::size_t address_length = 6;
constexpr std::size_t header_length = 14;
/// Set in the first byte of a group's address.
constexpr unsigned char group_bit = 1;

std::string_view destination(std::string_view frame) {
  return frame.substr(0, address_length);
}

std::string_view source(std::string_view frame) {
  return frame.substr(address_length, address_length);
}

bool is_broadcast(std::string_view address) {
  return address == "\xff\xff\xff\xff\xff\xff";
}

bool is_group(std::string_view address) {
  return (static_cast<unsigned char>(address.front()) & group_bit) != 0;
}

}  // namespace

Switch::Switch(std::size_t ports, std::uint64_t seed)
    : ports_(ports), ways_(ports * ports), chance_(seed) {}

Way& Switch::way(std::size_t from, std::size_t to) {
  return ways_.at(from * ports_ + to);
}

void Switch::take(std::size_t port, std::string frame, Time now) {
  if (frame.size() < header_length) {
    return;
  }
  ++counters_.taken;
  seen_.insert_or_assign(std::string(source(frame)), port);
  const std::string_view address = destination(frame);
  const auto known = is_group(address) ? seen_.end() : seen_.find(address);
  for (std::size_t to = 0; to < ports_; ++to) {
    if (to != port && (known == seen_.end() || known->second == to)) {
      send(port, to, frame, now);
    }
  }
}

void Switch::send(std::size_t from, std::size_t to, const std::string& frame, Time now) {
  const Way& way = this->way(from, to);
  const std::string_view address = destination(frame);
  const bool stopped = !way.multicast && is_group(address) && !is_broadcast(address);
  if (way.cut || stopped || std::bernoulli_distribution(way.loss)(chance_)) {
    ++counters_.lost;
    return;
  }
  std::uniform_int_distribution<std::int64_t> spread(-way.jitter.count(), way.jitter.count());
  const auto delay = way.delay + std::chrono::microseconds(spread(chance_));
  on_the_way_.emplace(now + delay, Delivery{to, frame});
}

std::vector<Delivery> Switch::due(Time now) {
  std::vector<Delivery> frames;
  const auto end = on_the_way_.upper_bound(now);
  for (auto frame = on_the_way_.begin(); frame != end; ++frame) {
    frames.push_back(std::move(frame->second));
  }
  on_the_way_.erase(on_the_way_.begin(), end);
  counters_.delivered += frames.size();
  return frames;
}

std::optional<Switch::Time> Switch::next() const {
  return on_the_way_.empty() ? std::nullopt : std::optional(on_the_way_.begin()->first);
}

}  // namespace millrace::tests::cluster
