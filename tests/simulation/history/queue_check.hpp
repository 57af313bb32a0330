// The guarantees for messages of a queue (docs/how-to/message-queues.md): none that stayed in the
// queue is lost, each gateway handles its own in their order, and a repetition has the id of its
// call. LastGet covers only messages that are in the journal or, with WHEN_ANSWERED, answered.
//
// Violations that no gateway can avoid (docs/how-to/message-queues.md) are excused: another client
// has moved LastGet so that the queue looks as before, or between a read and a write; and
// everything after the loss of a journal.
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
    /// Its loss or repetition is excused.
    bool pardoned = false;
    bool answered = false;
    std::set<GatewayNumber> taken_by{};
    std::set<GatewayNumber> answered_by{};
    /// Its call, by gateway: a different one where the configuration names another service.
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
    /// The messages that each element has held.
    std::map<std::uint32_t, std::vector<std::uint64_t>> elements{};
    /// The last accepted message of each number, by gateway.
    std::map<std::pair<GatewayNumber, std::uint64_t>, std::uint64_t> numbers{};
    std::map<GatewayNumber, std::uint64_t> claimed{};
    /// A read of it may return any content, and a reader may still confuse its messages.
    bool muddled = false;
    bool misleading = false;
  };

  void on(const QueuePlanned& fact);
  void on(const MessageWritten& fact);
  void on(const MessagesGone& fact);
  void on(const MessagesRead& fact);
  void on(const OutcomeUnknown& fact);
  void on(const MessageJournalled& fact);
  void on(const MessageEnded& fact);
  void on(const ProgramAsked& fact);
  void on(const Claimed& fact);
  void on(const Started& fact);
  void on(const JournalLost& fact);
  template <typename Other>
  void on(const Other&) {}
  template <typename... Arguments>
  void expect(bool right, const char* what, const Arguments&... arguments);
  /// Null if it is not a message of this queue.
  static Message* find(Ring& ring, std::uint64_t message);

  std::map<Key, Ring> rings_;
  /// The origin of a call.
  struct Origin {
    GatewayNumber gateway = 0;
    Key key;
    std::uint64_t message = 0;
    /// How often the gateway had lost its journal by then.
    unsigned losses = 0;
    unsigned services = 0;
  };
  std::map<GatewayNumber, unsigned> losses_;
  std::map<fabric::CallId, Origin> calls_;
  /// The queue of each channel name that a gateway uses for it.
  std::map<Key, std::pair<Key, GatewayNumber>> names_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
