// Brings one answer into a channel, and finds out when its program has gone on: which read or write
// comes next, decided by what reads show.
//
//   AnswerWriter writer(AnswerWriter::Kind::final, response);
//   writer.next()                                        → Step::read
//   writer.on_read(snapshot, status, request, now)     → Step::write_response
//   writer.on_written(now)                               → Step::record_clearing → clear → read
//   writer.on_read(snapshot, status, request, now)     → Step::write_state
//   writer.on_written(now)                               → Step::done
//   Released released(request, std::move(writer));
//   released.on_read(snapshot, now)                      → Found::request: the program asks again
//
// Each variable (Sent):
//
//   not sent ── written, or perhaps ──► sent ── a read shows it ──► shown
//                                       ▲  │  no read after 1 s (2 s, 4 s … 60 s) shows it: lost
//                                       └──┘
//
// The whole; "see" is a read that must show what was written, (…) what the program waits for:
//
//   interim            read ─ RESPONSE ─ see ─ RESPONSE_STATE ─ see ─ done
//   (RESPONSE_STATE)   read ─ RESPONSE ─ journal ─ REQUEST_STATE = 0 ─ see ─ RESPONSE_STATE ─ done
//   (RESPONSE)         read ─ journal ─ REQUEST_STATE = 0 ─ see ─ RESPONSE_STATE ─ see ─ RESPONSE ─ done
//
//   A read that shows a withdrawn or changed request, or the response of another writer, ends it:
//   dropped; after the release done.
//
//   done ──► Released ─┬─ REQUEST_STATE is 0, and the answer is shown or gone ──► idle
//               ▲      ├─ what only another request shows ──► request
//               └──────┴─ the release is lost: it is written again
//
// What is assumed of controllers, and what would go if a day on a machine proves the contrary:
//
//   LATE    How long after its acknowledgement a write is applied is not documented, so a write
//           counts when a read has shown it. Who wrote what a read shows is unknown: while writes
//           of another gateway may take effect, no interim answer begins. Else "see" would go.
//   LOST    An acknowledged write may never be applied. Else Sent::due_again and
//           Found::unreleased would go.
//   RESETS  Writing REQUEST_STATE sets RESPONSE_STATE to 0: documented for the program's writes
//           (IB/tf5200_service_interface/356533387.html), not for others. So RESPONSE_STATE comes
//           after REQUEST_STATE = 0.
//   CLEARS  A kernel may clear REQUEST_STATE itself once RESPONSE_STATE is written, and show no 0
//           before (who clears it is not documented). Else Clearing and
//           Released::decide_uncleared would go.
//
// A final answer is written as RESPONSE and REQUEST_STATE = 0; a read of all five variables shows
// both; then RESPONSE_STATE is written, which releases the program. So the program reads the whole
// RESPONSE, REQUEST_STATE was 0 before the program could go on, and each later REQUEST_STATE that
// is not 0 is a new request, however late this controller applies writes. Clearing REQUEST_STATE
// after the release could wipe the next request.
//
// A program that waits for a text in RESPONSE and reads no state (fabric::CompletionSignal) is
// released by RESPONSE, so that is written last, each once a read has shown the one before. A
// kernel that clears REQUEST_STATE for RESPONSE_STATE would else show 0 while our own 0 is still on
// its way to the next request. Such a program empties RESPONSE before it asks; what of its answer
// is 0 already is not written.
//
// Where a kernel RESETS also for others, a program that waits with SysServiceWait and @P1 = interim
// state may see RESPONSE_STATE 0 for the moment between the last two writes of the final answer; it
// must take 0 as "not yet".
//
// Where no read has shown REQUEST_STATE 0 before the release (CLEARS), the request is over when
// REQUEST_STATE reads another value, or 0 and the gateway has not written it, or when
// RESPONSE_STATE reads 0 after it has read the state of the answer (RESETS). Texts that differ
// prove that the program has gone on, not that its next request is complete.
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
  /// Whether the last write took place is unknown.
  bool unknown = false;
  bool shown = false;
  /// A read that was asked for later did not show it.
  bool late = false;
  /// The last read showed the value of the answer, by any writer.
  bool stands = false;

  void note(SteadyTime now, bool outcome_unknown = false) {
    ++times;
    last = now;
    unknown = outcome_unknown;
    shown = false;
  }
  /// The time from its acknowledgement until the first read that shows it.
  std::optional<std::chrono::nanoseconds> note_read(const ReadTime& read);
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
        response_(std::move(response)) {
    read_.state_stood = state_stood;
  }
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
    return earlier_run_.begun || sent_.text.times + sent_.zero.times + sent_.state.times > 0
               ? ReadSet::all
               : ReadSet::request;
  }
  [[nodiscard]] SteadyTime read_at() const { return read_at_; }
  /// Something has changed in the channel: the next read is due at once.
  void read_now() { read_at_ = {}; }

  /// How this controller handles REQUEST_STATE.
  struct Clearing {
    /// So many times is 0 written until a read shows it, then the answer goes on without (CLEARS).
    /// 0: no read is awaited. On a controller that shows 0, a release that does not wait for it
    /// lets the late 0 wipe the answer or the next request.
    unsigned most = 2;
    /// Whether 0 is written at all; false only if the kernel's behaviour is configured.
    bool is_written = true;
  };
  void set_clearing(Clearing clearing) { clearing_is_ = clearing; }
  /// It was written as often as that, and no read has shown 0.
  [[nodiscard]] bool does_without_clearing() const { return does_without_clearing_; }

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
    return !may_be_released() && (sent_.text.times == 0 || next_ != Step::read);
  }
  /// The write that releases the program.
  [[nodiscard]] const Sent& released() const { return text_last_ ? sent_.text : sent_.state; }
  /// REQUEST_STATE = 0 was written, or may have been.
  [[nodiscard]] bool may_be_cleared() const { return sent_.zero.times > 0; }
  /// The release comes next, and the first 0 that was written is what the last read has shown: no
  /// kernel has cleared it because of an interim state.
  [[nodiscard]] bool clearing_was_shown() const {
    return next_ == Step::write_state && !may_be_released() && sent_.zero.times == 1 &&
           sent_.zero.stands && read_.state == 0;
  }
  /// Writing 0 took more attempts than on an unknown controller.
  [[nodiscard]] bool clearing_took_long() const { return sent_.zero.times > 2; }
  /// A read has shown REQUEST_STATE 0 before the release.
  [[nodiscard]] bool zero_seen() const { return read_.zero_before_release; }
  /// A read has shown the state of the answer after it was written.
  [[nodiscard]] bool state_seen() const { return read_.state_seen; }
  /// RESPONSE_STATE as the last read before the release has shown it.
  [[nodiscard]] std::uint32_t state_before() const { return read_.state; }
  /// Why the answer is not complete; empty while there is no problem.
  [[nodiscard]] const fabric::Message& problem() const { return report_.problem; }
  /// The time from its acknowledgement until the last read, if that is the first one to show a
  /// write.
  std::optional<std::chrono::nanoseconds> take_shown_after() {
    return std::exchange(report_.shown_after, std::nullopt);
  }
  /// A line for the log that was not logged yet.
  std::optional<std::string> take_report() { return std::exchange(report_.line, std::nullopt); }

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
  void note_shown(Sent& sent, const ReadTime& time);
  [[nodiscard]] Step over() const { return may_be_released() ? Step::done : Step::dropped; }

  Kind kind_;
  bool text_last_ = false;
  Response response_;
  Clearing clearing_is_;
  /// It goes on although no read has shown 0.
  bool does_without_clearing_ = false;
  /// The journal knows that REQUEST_STATE is being cleared.
  bool clearing_recorded_ = false;
  Step next_ = Step::read;
  SteadyTime read_at_{};
  /// RESPONSE, REQUEST_STATE = 0, RESPONSE_STATE.
  struct {
    Sent text, zero, state;
  } sent_;
  struct {
    /// It may have begun; it may have written all (false after the first read).
    bool begun = false;
    bool all = false;
    /// RESPONSE was written by this run, or may have been.
    bool text_rewritten = false;
  } earlier_run_;
  /// What reads have shown.
  struct {
    /// REQUEST_STATE 0, by any writer; and before the release.
    bool zero = false;
    bool zero_before_release = false;
    /// RESPONSE_STATE in the last read before the release. The state of the answer, shown before it
    /// was written, and after.
    std::uint32_t state = 0;
    bool state_stood = false;
    bool state_seen = false;
    /// How often in a row that the release did not take place: two reads must show it.
    unsigned unreleased = 0;
  } read_;
  struct {
    std::optional<std::chrono::nanoseconds> shown_after;
    fabric::Message problem;
    std::optional<std::string> line;
  } report_;
};

/// An answer whose last write the controller has acknowledged, until reads show that its program
/// has gone on. Only then is REQUEST_STATE ≠ 0 another request.
class Released {
 public:
  /// `answer` is done.
  Released(PendingRequest request, AnswerWriter answer)
      : request_(std::move(request)),
        answer_(std::move(answer)),
        sent_(answer_.released()),
        zero_seen_(answer_.zero_seen()),
        state_seen_(answer_.state_seen() && answer_.state() != 0),
        whole_(answer_.text_last()) {}

  enum class Found : std::uint8_t {
    /// Not known yet: read reads() at read_at().
    nothing,
    /// The release has no effect: write variable() and value() again.
    unreleased,
    /// The NC program has its answer, and the channel has no request.
    idle,
    /// The NC program has its answer and made a new request; its texts must be read.
    request,
  };
  Found on_read(const ServiceSnapshot& snapshot, const ReadTime& time);
  /// The release was written again, or may have been.
  void on_written(SteadyTime now);

  [[nodiscard]] ReadSet reads() const { return whole_ ? ReadSet::all : ReadSet::states; }
  /// Nothing: like an idle channel.
  [[nodiscard]] std::optional<SteadyTime> read_at() const { return read_at_; }
  void read_now() { read_at_ = SteadyTime{}; }
  [[nodiscard]] Variable variable() const {
    return answer_.text_last() ? Variable::response : Variable::response_state;
  }
  [[nodiscard]] Value value() const {
    return answer_.text_last() ? Value(answer_.text()) : Value(answer_.state());
  }

  /// Until when RESPONSE_STATE may still take effect, if no read has shown it yet. Empty if a read
  /// has, or if RESPONSE releases the NC program.
  [[nodiscard]] std::optional<SteadyTime> unseen_until() const {
    return answer_.text_last() || state_seen_ ? std::nullopt
                                              : std::optional(sent_.last + takes_effect);
  }
  /// Why it is not over; empty while there is no problem.
  [[nodiscard]] const fabric::Message& problem() const { return problem_; }

 private:
  Found decide(const ServiceSnapshot& snapshot, const ReadTime& time);
  /// CLEARS: no read has shown REQUEST_STATE 0 yet.
  Found decide_uncleared(const ServiceSnapshot& snapshot, const ReadTime& time);
  Found release_again(const ReadTime& time);

  PendingRequest request_;
  AnswerWriter answer_;
  /// The release.
  Sent sent_;
  /// REQUEST_STATE was read as 0: the channel is idle, or has another request.
  bool zero_seen_ = false;
  /// A read has shown what releases the program; and the state, which its next write of
  /// REQUEST_STATE sets to 0.
  bool release_seen_ = false;
  bool state_seen_ = false;
  bool whole_ = false;
  std::optional<SteadyTime> read_at_{SteadyTime{}};
  /// Since when reads show what only a program that went on can have written.
  std::optional<SteadyTime> moved_on_;
  fabric::Message problem_;
};

}  // namespace millrace::gateway::channel
