// One message queue of a controller, whole: reads it, has its messages journalled, shows them one
// after the other as the requests of a channel, and has LastGet written when its time has come.
// Pure.
//
//   MessageQueue queue("press", settings, journal.state().queues()[key]);
//   queue.on_up(now);
//   while (auto step = queue.next(now)) …              // ReadControl → on_control(), …
//   for (auto& entry : queue.take_output().entries) …    // journal them; then on_journalled()
//   queue.snapshot(ReadSet::request)                       // the message whose turn it is
//   queue.write({Variable::response_state, 1, true}, now)      // its answer
//
// The order in the journal is what makes a crash harmless: a message before LastGet covers it; its
// end before the end of its call (JournalState). Calls are of a key of their own, "press.alarms/1",
// so nothing of the Service Interface of channel 1 replaces them, nor the other way round.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "fabric/data.hpp"
#include "gateway/moment.hpp"
#include "gateway/outputs.hpp"
#include "gateway/queue_log.hpp"
#include "gateway/queues/queue_reader.hpp"
#include "gateway/queues/queue_service_interface.hpp"
#include "gateway/queues/queue_settings.hpp"

namespace millrace::gateway::queues {

/// The numbers of a queue, for observers.
struct QueueView {
  /// Of the last read; nothing before the first.
  std::optional<Control> control{};
  std::uint64_t messages = 0;
  std::uint64_t answered = 0;
  std::uint64_t waiting = 0;
  /// Why it is not read; empty if it is.
  fabric::Message trouble{};
  /// The response to the last message.
  std::string response{};
  std::uint32_t response_state = 0;
  bool operator==(const QueueView&) const = default;
};

class MessageQueue {
 public:
  /// After a warning that it fills up, it must be half empty before the next one.
  static constexpr std::chrono::seconds patience{1};

  /// `queue_log` is what the journal knows of it. With messages in it the first news are there at
  /// once.
  MessageQueue(const std::string& machine, QueueSettings settings, QueueLog queue_log);

  /// The queue of this key has a new configuration. Its pending message continues; the link comes
  /// next.
  void change(QueueSettings settings);

  struct Output {
    /// Entries for the journal, in order; on_journalled() when the last of them is safe, if `wait`.
    std::vector<JournalEntry> entries{};
    bool wait = false;
    /// The service interface has another message.
    bool shows = false;
    std::vector<LogLine> lines{};
    /// It cannot be read, or fills up; or, with an empty text, it recovered.
    std::optional<fabric::Message> trouble{};
    std::optional<fabric::Message> filling{};
  };
  /// The results of the events since the last call.
  Output take_output();

  // The controller.
  void on_up(Moment now);
  void on_down(const fabric::Message& reason);
  void on_event(Moment now);
  std::optional<Step> next(Moment now);
  [[nodiscard]] std::optional<SteadyTime> next_time() const {
    return settled_ ? reader_.next_time() : std::nullopt;
  }
  void on_control(const Answer<Control>& answer, Moment now);
  void on_array(Answer<std::vector<std::string>> answer, Moment now);
  void on_written(const Answer<void>& answer, Moment now);

  /// The journal has stored the entries of take_output().
  void on_journalled(Moment now);

  // The call of the message whose turn it is.
  [[nodiscard]] ServiceSnapshot snapshot(ReadSet what) const {
    return service_interface_.snapshot(what);
  }
  void on_read(ReadSet what) { service_interface_.on_read(what); }
  void write(const Write& write, Moment now);
  /// The last write was acknowledged: the next message may be shown.
  void on_acknowledged();

  [[nodiscard]] const fabric::ChannelKey& key() const { return key_; }
  [[nodiscard]] const QueueSettings& settings() const { return settings_; }
  [[nodiscard]] const QueueLog& queue_log() const { return queue_log_; }
  [[nodiscard]] QueueView view() const;

 private:
  void take(QueueReader::ReadResult result, Moment now);
  void note(JournalEntry entry);
  void wait_for_journal();
  void show_next();
  void check_filling(Moment now);
  [[nodiscard]] std::uint64_t writable() const;
  [[nodiscard]] std::size_t room() const;

  QueueSettings settings_;
  fabric::ChannelKey key_;
  QueueLog queue_log_;
  QueueReader reader_;
  QueueServiceInterface service_interface_;
  Output output_;
  /// Messages up to this number are safe.
  std::uint64_t journalled_ = 0;
  /// … and up to each of these with the next on_journalled(): over a new link more is read while
  /// the journal still writes what came before it.
  std::deque<std::uint64_t> journalling_;
  /// The journal has stored the initial entries: until then LastGet is not written.
  bool settled_ = true;
  fabric::Message trouble_;
  /// Since when it has been three quarters full, and whether that was said.
  std::optional<SteadyTime> filling_since_;
  bool filling_logged_ = false;
};

// A message queue in numbers, as machine data have them.

/// The group "queue" of its key (fabric/data.hpp).
[[nodiscard]] fabric::DataSample sample_of(const fabric::ChannelKey& key,
                                           const QueueSettings& settings, const QueueView& view,
                                           fabric::Time at);

}  // namespace millrace::gateway::queues
