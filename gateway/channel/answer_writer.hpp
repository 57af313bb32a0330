// Brings one answer into a channel: which read or write comes next, decided by what reads show.
//
//   AnswerWriter writer(AnswerWriter::Kind::final, response);
//   writer.next()                                        → Step::read
//   writer.on_read(snapshot, status, request, now)     → Step::write_response
//   writer.on_written(now)                               → Step::record_clearing → clear → read
//   writer.on_read(snapshot, status, request, now)     → Step::write_state
//   writer.on_written(now)                               → Step::done
//
// A write counts when a read has shown it, never when it was acknowledged: how long after the
// acknowledgement a controller applies a write is not documented. A final answer is written as
// RESPONSE and REQUEST_STATE = 0; a read of all five variables shows both; then RESPONSE_STATE is
// written, which releases the program. So the program reads the whole RESPONSE, REQUEST_STATE was
// 0 before the program could go on, and each later REQUEST_STATE that is not 0 is a new request,
// however late this controller applies writes. Clearing REQUEST_STATE after the release could wipe
// the next request; a kernel that clears RESPONSE_STATE whenever REQUEST_STATE is written
// (documented for the program's writes, not for others) would wipe the answer.
//
// A program that waits for a text in RESPONSE and reads no state (fabric::CompletionSignal) is
// released by RESPONSE, so that is written last: REQUEST_STATE = 0, RESPONSE_STATE, then RESPONSE,
// each once a read has shown the one before. A kernel that clears REQUEST_STATE for RESPONSE_STATE
// would else show 0 while our own 0 is still on its way to the next request. Such a program empties
// RESPONSE before it asks; what of its answer is 0 already is not written.
//
// An interim answer is RESPONSE, which a read must show, and RESPONSE_STATE. On a kernel of the
// kind just named, a program that waits with SysServiceWait and @P1 = interim state may see
// RESPONSE_STATE 0 for the moment between the last two writes of the final answer; it must take 0
// as "not yet".
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/moment.hpp"
#include "gateway/response.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::channel {

/// A write that no read has shown within this time, far above any task cycle of a controller, is
/// lost and not late (our choice): it is written again. Then after twice that time, and so on.
inline constexpr std::chrono::milliseconds takes_effect{1000};
inline constexpr std::chrono::milliseconds longest_repeat{60'000};

/// When a snapshot was asked for, and when it came. It shows the channel at a time in between.
struct ReadTime {
  SteadyTime asked{};
  SteadyTime came{};
  /// Not too old to write something again because of it: this gateway may have stood still, and the
  /// program have gone on (our choice).
  [[nodiscard]] bool fresh() const { return came - asked <= std::chrono::milliseconds(250); }
};

/// One variable of an answer: how often it was written, and when last. A write of unknown outcome
/// counts.
struct Sent {
  unsigned times = 0;
  SteadyTime last{};
  bool shown = false;
  /// A read that was asked for later did not show it.
  bool late = false;

  void note(SteadyTime now) {
    ++times;
    last = now;
    shown = false;
  }
  /// The time from its acknowledgement until the first read that shows it.
  std::optional<std::chrono::nanoseconds> note_read(bool shows, const ReadTime& read);
  /// A read that was asked for then and does not show it proves that it is lost.
  [[nodiscard]] bool due_again(const ReadTime& read) const;
  /// When the next read is worth its request while this write is not visible.
  [[nodiscard]] SteadyTime next_read(SteadyTime now) const;
};

class AnswerWriter {
 public:
  enum class Kind : std::uint8_t { interim, final };

  enum class Step : std::uint8_t {
    /// Read reads(), not before read_at().
    read,
    write_response,
    /// Journal that REQUEST_STATE is about to be cleared, then on_recorded().
    record_clearing,
    clear,
    write_state,
    /// The answer is written, or the NC program has read it and continued.
    done,
    /// The NC program withdrew or changed the request, or another writer answered it: drop the
    /// response.
    dropped,
  };

  /// `state_stood` if the channel may show the state of this answer already, as that of an interim
  /// one.
  AnswerWriter(
      Kind kind, Response response,
      fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state,
      bool state_stood = false)
      : kind_(kind),
        text_last_(completion_signal == fabric::CompletionSignal::response),
        response_(std::move(response)),
        state_stood_(state_stood) {}
  /// A final answer that an earlier run of the gateway may have begun to write; `clearing` if the
  /// journal has what record_clearing asks for, so that all of it may be written.
  static AnswerWriter resumed(
      Response response, bool clearing,
      fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state,
      bool state_stood = false);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] Step next() const { return next_; }
  [[nodiscard]] const std::string& text() const { return response_.text(); }
  [[nodiscard]] std::uint32_t state() const { return response_.state(); }
  [[nodiscard]] bool text_last() const { return text_last_; }
  /// The variables that a read must cover: all, once a write was or may have been sent.
  [[nodiscard]] ReadSet reads() const {
    return resumed_ || response_sent_.times + clear_sent_.times + state_sent_.times > 0
               ? ReadSet::all
               : ReadSet::request;
  }
  [[nodiscard]] SteadyTime read_at() const { return read_at_; }
  /// Something has changed in the channel: the next read is due at once.
  void read_now() { read_at_ = {}; }

  /// How this controller handles REQUEST_STATE.
  struct Clearing {
    /// A read shows 0 after 0 was written; false where the kernel clears it itself once
    /// RESPONSE_STATE is written, and no read shows 0 before that.
    bool is_shown = true;
    /// Whether 0 is written at all; false only if the kernel's behaviour is configured.
    bool is_written = true;
    /// Reads of earlier answers have shown 0. A kernel does not change, so a 0 that is not shown
    /// now is lost or late: it is written five times before this is taken for the other kind of
    /// controller, and not twice (our choice). On a controller that shows 0, a release that does
    /// not wait for it lets the late 0 wipe the answer or the next request.
    bool was_shown = false;
  };
  void set_clearing(Clearing clearing) { clearing_is_ = clearing; }
  /// As set, or false once this answer has found that no read shows 0.
  [[nodiscard]] bool clearing_is_shown() const { return clearing_is_.is_shown; }

  /// `status` is what OpenCall::on_snapshot() says of this snapshot.
  Step on_read(const ServiceSnapshot& snapshot, RequestStatus status, const PendingRequest& request,
               const ReadTime& time);
  /// The controller acknowledged the write that next() named.
  Step on_written(SteadyTime now);
  /// It is unknown whether the write took place: timeout, link lost. It is never repeated blindly.
  Step on_unknown(SteadyTime now);
  /// The journal holds what record_clearing asked for. `fresh` if the last read is recent enough to
  /// trust for one more write; otherwise the request is read once more.
  Step on_recorded(bool fresh);
  /// Nothing was written, and the last read is too old: the controller refused.
  Step read_again();
  /// The same on a new connection. Steps that do not affect what the NC program sees are repeated.
  void on_link_up();
  /// The channel shows a state that may change by itself: read again a little later.
  void wait(SteadyTime now);

  /// The write that releases the program was sent, or may have been.
  [[nodiscard]] bool may_be_released() const { return released().times > 0; }
  /// Nothing of it is on its way: its text is not written, visible or lost, its state not written.
  /// The next answer may have the text that stood there before, which would be taken for its own.
  [[nodiscard]] bool may_be_dropped() const {
    return !may_be_released() && (response_sent_.times == 0 || next_ != Step::read);
  }
  /// The write that releases the program.
  [[nodiscard]] const Sent& released() const { return text_last_ ? response_sent_ : state_sent_; }
  /// REQUEST_STATE = 0 was written, or may have been.
  [[nodiscard]] bool may_be_cleared() const { return clear_sent_.times > 0; }
  /// The release comes next, and the first 0 that was written is what the last read has shown: no
  /// kernel has cleared it because of an interim state.
  [[nodiscard]] bool clearing_was_shown() const {
    return next_ == Step::write_state && !may_be_released() && clear_sent_.times == 1 &&
           request_state_zero_ && state_before_ == 0;
  }
  /// Writing 0 took more attempts than on an unknown controller.
  [[nodiscard]] bool clearing_took_long() const { return clear_sent_.times > 2; }
  /// A read has shown REQUEST_STATE 0 before the release.
  [[nodiscard]] bool zero_seen() const { return zero_seen_; }
  /// A read has shown the state of the answer after it was written.
  [[nodiscard]] bool state_seen() const { return state_seen_; }
  /// RESPONSE_STATE as the last read has shown it: once it is done, what stood before the release.
  [[nodiscard]] std::uint32_t state_before() const { return state_before_; }
  /// Why the answer is not complete; empty while there is no problem.
  [[nodiscard]] const fabric::Message& problem() const { return problem_; }
  /// The time from its acknowledgement until the last read, if that is the first one to show a
  /// write.
  std::optional<std::chrono::nanoseconds> take_shown_after() {
    return std::exchange(shown_after_, std::nullopt);
  }
  /// A line for the log that was not logged yet.
  std::optional<std::string> take_report() { return std::exchange(report_, std::nullopt); }

 private:
  [[nodiscard]] Step decide_interim(const ServiceSnapshot& snapshot, RequestStatus status,
                                    const PendingRequest& request, const ReadTime& time);
  [[nodiscard]] Step decide_final(const ServiceSnapshot& snapshot, RequestStatus status,
                                  const PendingRequest& request, const ReadTime& time);
  /// REQUEST_STATE is still what the program wrote.
  [[nodiscard]] Step decide_uncleared(const ReadTime& time);
  /// The remaining steps before the release, and the release.
  [[nodiscard]] Step complete(const ReadTime& time);
  [[nodiscard]] Step release(const ReadTime& time);
  /// Writes it, or, once that is done, waits for a read to show it.
  [[nodiscard]] Step bring(const Sent& sent, Step write, std::string_view what,
                           const ReadTime& time);
  [[nodiscard]] Step clear() const;
  void note_shown(Sent& sent, bool shows, const ReadTime& time);
  [[nodiscard]] Step over() const { return may_be_released() ? Step::done : Step::dropped; }
  void repeat(const Sent& sent, std::string_view what);

  Kind kind_;
  bool text_last_ = false;
  Response response_;
  bool state_stood_ = false;
  bool resumed_ = false;
  /// An earlier run may have written all of it. False after the first read.
  bool all_may_be_written_ = false;
  Clearing clearing_is_;
  Step next_ = Step::read;
  SteadyTime read_at_{};

  Sent response_sent_;
  Sent clear_sent_;
  Sent state_sent_;
  /// RESPONSE was written in this run of the gateway, or may have been.
  bool written_here_ = false;
  bool response_unknown_ = false;
  /// The journal knows that REQUEST_STATE is being cleared.
  bool clearing_recorded_ = false;

  // Values of the last read.
  bool request_state_zero_ = false;
  bool response_stands_ = false;
  bool state_stands_ = false;

  /// A read has shown 0, by any writer.
  bool zero_read_ = false;
  bool zero_seen_ = false;
  bool state_seen_ = false;
  std::uint32_t state_before_ = 0;
  /// A read has shown that a release of unknown outcome did not take place; the next must, too.
  bool unreleased_ = false;
  bool at_once_ = false;
  std::optional<std::chrono::nanoseconds> shown_after_;
  fabric::Message problem_;
  std::optional<std::string> report_;
};

}  // namespace millrace::gateway::channel
