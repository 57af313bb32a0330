// Reads a message queue: the next request to the controller, and the meaning of its responses.
// Pure.
//
// One round: the control structure; if it names messages, the whole array; the control structure
// again, so that an initialisation in between is detected; the messages are journalled; the control
// structure; LastGet is written; the control structure, which begins the next round. Each step is
// one request, answered by the function of its name.
//
//   QueueReader reader(settings.period);
//   reader.on_up(now);
//   reader.next(queue_log, writable, now)  // ReadControl → on_control(), ReadQueue → on_array()
//
// The expected LastGet is known: as this gateway last read or wrote it (QueueLog::last_get). If it
// differs, an NC program has initialised the queue or another reader uses it: the new value is
// adopted, and logged. Two cases cannot be detected: a queue that is initialised between the last
// read and the write of LastGet, and one that is initialised and filled again up to its old
// position between two reads.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "gateway/moment.hpp"
#include "gateway/queue_log.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

/// Read the control structure.
struct ReadControl {
  bool operator==(const ReadControl&) const = default;
};
/// Read the whole array.
struct ReadQueue {
  bool operator==(const ReadQueue&) const = default;
};
struct WriteLastGet {
  std::uint32_t element = 0;
  bool operator==(const WriteLastGet&) const = default;
};
using Step = std::variant<ReadControl, ReadQueue, WriteLastGet>;

// The responses of a controller to the requests of a message queue.

template <typename T>
using Answer = tl::expected<T, fabric::Message>;

/// The result of a Step, in the order of their types; errors are phrases that follow the name of
/// the queue.
using StepAnswer = std::variant<Answer<Control>, Answer<std::vector<std::string>>, Answer<void>>;

class QueueReader {
 public:
  /// After an error of the controller, or impossible values.
  static constexpr std::chrono::milliseconds retry{500};

  explicit QueueReader(std::chrono::milliseconds period) : period_(period) {}

  void set_period(std::chrono::milliseconds period) { period_ = period; }

  /// The result of a response.
  struct ReadResult {
    /// New messages: their elements and texts.
    struct Found {
      std::uint32_t element = 0;
      std::string text;
    };
    std::vector<Found> messages{};
    /// LastGet is this element, and covers messages up to this number.
    struct Covers {
      std::uint32_t element = 0;
      std::uint64_t number = 0;
      bool operator==(const Covers&) const = default;
    };
    std::optional<Covers> covers{};
    /// LastGet differs from the gateway's last value; the reason in words.
    std::string resynchronised{};
    /// An impossible value, or the controller's error: nothing is written.
    fabric::Message wrong{};
    /// The queue responds, with possible values.
    bool fine = false;
  };

  /// The next responses come from a new link.
  void on_up(Moment now);
  /// No more requests, and pending ones get no response.
  void on_down();
  /// The controller notified a change; a late or needless notification does no harm.
  void on_event(Moment now);
  /// The messages that were found are journalled.
  void on_journalled(Moment now);
  /// LastGet may be written now that could not before.
  void read_again(Moment now);

  /// The next request. `writable`: the number of the last message that LastGet may cover.
  std::optional<Step> next(const QueueLog& queue_log, std::uint64_t writable, Moment now);
  /// When next() has something, if nothing else happens.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

  /// `room`: the number of messages that may be taken.
  ReadResult on_control(const Answer<Control>& answer, const QueueLog& queue_log, std::size_t room,
                        Moment now);
  ReadResult on_array(Answer<std::vector<std::string>> answer, const QueueLog& queue_log,
                      Moment now);
  /// Written, refused or unknown: the next read decides. Returns the text of a refusal.
  ReadResult on_written(const Answer<void>& answer, Moment now);

  /// Of the last read that was right, and LastGet as it was written since.
  [[nodiscard]] const std::optional<Control>& control() const { return control_; }

 private:
  enum class Phase : std::uint8_t {
    /// No link.
    down,
    /// The control structure is to be read when it is time.
    waiting,
    reading_control,
    /// It names messages.
    wants_array,
    reading,
    /// The array is read; is the control structure still the one it was?
    wants_check,
    checking,
    /// The journal writes them.
    journalling,
    writing,
  };

  ReadResult inspect(const Control& control, const QueueLog& queue_log, std::size_t room,
                     Moment now);
  ReadResult check(const Control& control, const QueueLog& queue_log, std::size_t room, Moment now);
  [[nodiscard]] std::string compare(const QueueLog& queue_log) const;
  void wait(std::chrono::nanoseconds time, Moment now);
  ReadResult fail(fabric::Message why, Moment now);

  std::chrono::milliseconds period_;
  Phase phase_ = Phase::down;
  SteadyTime due_{};
  std::optional<Control> control_;
  std::vector<std::string> texts_;
  /// Messages may be taken up to here: LastFilled of the read before the array was read.
  Control before_;
  std::size_t room_ = 0;
  /// Messages of the log that LastGet does not cover are compared with the array: the controller
  /// may have been anything since they were read.
  bool compare_ = false;
  /// The last read has shown LastGet as the log has it: it may be written.
  bool fresh_ = false;
  /// A notification came while another request was pending.
  bool notified_ = false;
  /// The last written value, until a read shows it.
  std::optional<std::uint32_t> tried_;
};

}  // namespace millrace::gateway::queues
