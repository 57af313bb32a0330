// An Ethernet switch with bad cables: it decides where each frame goes, and when, or whether it is
// lost. Pure; all randomness comes from a seed.
//
//   Switch sut(3, seed);
//   sut.way(0, 1).loss = 0.1;
//   sut.take(0, frame, now);
//   for (Delivery& frame : sut.due(now)) …      // and again when sut.next() has come
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace millrace::tests::cluster {

/// One direction between two ports.
struct Way {
  bool cut = false;
  /// Frames for groups pass. Broadcasts always do, because ARP needs them.
  bool multicast = true;
  /// Share of the frames that are lost, 0 to 1.
  double loss = 0;
  /// Each frame takes between delay - jitter and delay + jitter, so that frames overtake each
  /// other.
  std::chrono::microseconds delay{0};
  std::chrono::microseconds jitter{0};
};

struct Delivery {
  std::size_t port = 0;
  std::string frame;
};

class Switch {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Counters {
    std::uint64_t taken = 0;
    std::uint64_t lost = 0;
    std::uint64_t delivered = 0;
  };

  Switch(std::size_t ports, std::uint64_t seed);

  /// A direction, which the caller may change.
  [[nodiscard]] Way& way(std::size_t from, std::size_t to);

  /// A frame that arrived at `port`. It goes where its destination was last seen, otherwise to all
  /// other ports.
  void take(std::size_t port, std::string frame, Time now);
  /// The frames that are due.
  std::vector<Delivery> due(Time now);
  /// When the next frame is due; nothing if no frame is under way.
  [[nodiscard]] std::optional<Time> next() const;

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void send(std::size_t from, std::size_t to, const std::string& frame, Time now);

  std::size_t ports_;
  std::vector<Way> ways_;
  /// The last port of each sender, by its address.
  std::map<std::string, std::size_t, std::less<>> seen_;
  std::multimap<Time, Delivery> on_the_way_;
  std::mt19937_64 chance_;
  Counters counters_;
};

}  // namespace millrace::tests::cluster
