// What is promised of the messages of a queue (docs/how-to/message-queues.md): none that stayed in
// the queue is lost, each gateway brings its own in their order, and a repeat has the id of its
// call. LastGet covers no message that is not in the journal, or, with WHEN_ANSWERED, not answered.
//
// What nobody can see (docs/how-to/message-queues.md) is pardoned: a queue that somebody else has
// moved and that looks as before, or between a look and a write; and what a gateway did whose
// journal was lost.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class QueueCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;
  std::vector<std::string> at_the_end() override;

 private:
  struct Message {
    std::string text;
    /// It may be lost, or called again.
    bool pardoned = false;
    bool answered = false;
    std::set<GatewayNumber> taken_by{};
    std::set<GatewayNumber> answered_by{};
    /// Its call, of each gateway: another one where the configuration names another service.
    struct Called {
      std::string uuid{};
      unsigned services = 0;
      std::optional<fabric::CallId> first{};
    };
    std::map<GatewayNumber, Called> calls{};
  };
  struct Ring {
    bool when_answered = false;
    bool repeats = false;
    /// Counted from 1.
    std::vector<Message> messages;
    /// The messages that have stood in each element.
    std::map<std::uint32_t, std::vector<std::uint64_t>> elements{};
    /// The message of each number, the last that was claimed, of each gateway.
    std::map<std::pair<GatewayNumber, std::uint64_t>, std::uint64_t> numbers{};
    std::map<GatewayNumber, std::uint64_t> claimed{};
    /// Anything may be read of it; and somebody may still take messages of it for others.
    bool muddled = false;
    bool misleading = false;
  };

  void on(const QueuePlanned& fact);
  void on(const MessageWritten& fact);
  void on(const MessagesGone& fact);
  void on(const MessagesRead& fact);
  void on(const NobodyCanTell& fact);
  void on(const MessageTaken& fact);
  void on(const MessageEnded& fact);
  void on(const ProgramAsked& fact);
  void on(const Claimed& fact);
  void on(const Started& fact);
  void on(const JournalLost& fact);
  template <typename Other>
  void on(const Other&) {}
  template <typename... Arguments>
  void expect(bool right, const char* what, const Arguments&... arguments);
  /// Null if it is none of the messages of this queue.
  static Message* find(Ring& ring, std::uint64_t message);

  std::map<Key, Ring> rings_;
  /// Where calls have come from.
  struct Origin {
    GatewayNumber gateway = 0;
    Key key;
    std::uint64_t message = 0;
    /// How often it had lost its journal by then.
    unsigned losses = 0;
    unsigned services = 0;
  };
  std::map<GatewayNumber, unsigned> losses_;
  std::map<fabric::CallId, Origin> calls_;
  /// Claims name a queue as its gateway does.
  std::map<Key, std::pair<Key, GatewayNumber>> names_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
