// The actions of a gateway's channels, and the ports that execute them.
#pragma once

#include <cstdint>
#include <string>

#include "fabric/alarm.hpp"
#include "fabric/messages.hpp"
#include "fabric/request_key.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/moment.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {

// Which outputs of channels have readers. Without a reader they are not made: to make the events,
// states and log lines of a call and to discard them costs a fifth of the call.

enum class Level : std::uint8_t { debug, info, warn, error };

struct LogLine {
  Level level = Level::info;
  std::string text{};
};

struct Readers {
  /// Events have a reader.
  bool events = true;
  /// The states of channels have a reader.
  bool statuses = true;
  /// The log drops what is below.
  Level min_level = Level::debug;
  bool operator==(const Readers&) const = default;
};

/// Of one variable of a Service Interface.
struct Write {
  Variable variable = Variable::request_state;
  Value value;
  /// The last write of a final answer, which releases the program.
  bool releases = false;
  bool operator==(const Write&) const = default;
};

/// The result of a write.
enum class WriteOutcome : std::uint8_t {
  written,
  /// The controller said no, or nothing was sent.
  refused,
  /// Timeout, link lost: perhaps it was written, perhaps not.
  unknown,
};

// The ports of channels. No function calls back from within.

/// The Service Interface of a channel: a controller's, or the one that the gateway plays for the
/// messages of a queue.
class ServiceAccess {
 public:
  virtual ~ServiceAccess() = default;
  /// A channel has at most one read or write under way, and each gets exactly one answer (on_read,
  /// on_read_failed, on_write), also when the link ends.
  virtual void read(const fabric::ChannelKey& key, ReadSet set) = 0;
  virtual void write(const fabric::ChannelKey& key, const Write& write, Moment now) = 0;
  /// The channel is not ours any more.
  virtual void on_over(const fabric::ChannelKey& key) = 0;
};

/// The DDS writers of calls.
class CallTopics {
 public:
  virtual ~CallTopics() = default;
  virtual void publish(const fabric::Request& request) = 0;
  virtual void publish(const fabric::Event& event) = 0;
  /// Each change, while there is a reader.
  virtual void publish(const fabric::ChannelStatus& status) = 0;
  /// Tells the instance that its response is not needed any more.
  virtual void dispose(const fabric::RequestKey& request) = 0;
  /// The channel is not ours any more.
  virtual void dispose(const fabric::ChannelKey& status) = 0;
};

/// Journal, log and alarms of the gateway.
class Records {
 public:
  virtual ~Records() = default;
  /// Journal this; on_recorded(ticket) follows, if the caller waits, once it is as safe as the
  /// journal's policy promises.
  virtual void append(const JournalEntry& entry, const Ticket& ticket) = 0;
  virtual void log(Level level, const std::string& text) = 0;
  /// Raises an alarm of the gateway, or clears it if `text` is empty.
  virtual void set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                         const fabric::Message& advice) = 0;
};

}  // namespace millrace::gateway
