// A message queue in a controller, the program that writes into it, and sometimes a second reader.
// It sees all of them, so it identifies each message whatever its text.
//
//   MessageRing ring(key, plan, agenda, party, history, random);
//   ring.start();                                     // SSDQInit, SSDQ, SSDQ …
//   ring.control(); ring.texts(); ring.write_last_get(3, gateway);           // over ADS
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/queues/queue_settings.hpp"
#include "gateway/queues/ring.hpp"
#include "tests/simulation/history/history.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct RingPlan {
  /// Its settings in the gateways' configurations.
  gateway::queues::QueueSettings settings;
  std::uint32_t elements = 3;
  std::size_t messages = 10;
  /// The time between two messages; an element and LastFilled are written within a cycle.
  Time pause = 20ms;
  Time cycle = 2ms;
  /// Percentages of messages before which the program initialises the queue, and after which
  /// another client reads.
  unsigned initialises = 0;
  unsigned read_by_others = 0;
  /// Messages have two different texts only.
  bool repeats = false;
  /// Its content survives when the controller is switched off.
  bool keeps = true;
};

class MessageRing {
 public:
  MessageRing(Key key, RingPlan plan, Agenda& agenda, Party party, History& history, Random random);

  [[nodiscard]] const Key& key() const { return key_; }
  [[nodiscard]] const RingPlan& plan() const { return plan_; }

  // Over ADS.
  [[nodiscard]] gateway::queues::Control control() const;
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }
  void write_last_get(std::uint32_t element, GatewayNumber gateway);
  /// The control structure as read, and how often other clients than this gateway had moved LastGet
  /// by then.
  struct Sight {
    std::uint64_t moves = 0;
    std::int64_t last_get = 0;
    /// The LastGet that the gateway has written since.
    std::optional<std::int64_t> written{};
  };
  [[nodiscard]] Sight sight(GatewayNumber gateway) const;
  /// The gateway receives this sight.
  void seen(GatewayNumber gateway, Sight sight);
  /// The gateway connects, and will compare what it knows with what it finds.
  void connected(GatewayNumber gateway);

  // Starts the program.
  void start();
  void stop();
  void calm_down();
  void power_up();
  [[nodiscard]] bool done() const;

  /// Called after a change.
  std::map<const void*, std::function<void()>> watchers;

 private:
  void after(Time delay, void (MessageRing::*step)());
  void begin();
  void initialise();
  void write();
  void fill();
  void let_others_read();
  void lose(const std::string& why, std::size_t messages);
  void moved(std::optional<GatewayNumber> by);
  [[nodiscard]] bool valid() const { return wrong_with(control()).empty(); }
  [[nodiscard]] std::vector<std::uint64_t> standing() const;

  Key key_;
  RingPlan plan_;
  Agenda& agenda_;
  Party party_;
  History& history_;
  Random random_;
  std::vector<std::string> texts_;
  /// The number of the last message written into each element; 0 = none.
  std::vector<std::uint64_t> numbers_;
  std::int64_t last_filled_ = 0;
  std::int64_t last_get_ = 0;
  /// How often LastGet was moved, and by which gateway.
  std::uint64_t moves_ = 0;
  std::map<GatewayNumber, std::uint64_t> moved_by_;
  std::map<GatewayNumber, Sight> sights_;

  std::size_t left_;
  bool active_ = false;
  bool calm_ = false;
  std::uint64_t life_ = 0;
  std::uint64_t written_ = 0;
  /// The element that is being written, before LastFilled has its number.
  std::uint32_t position_ = 0;
};

}  // namespace millrace::tests::simulation
