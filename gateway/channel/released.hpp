// An answer whose last write the controller has acknowledged, until reads show that its program has
// gone on. Only then is REQUEST_STATE ≠ 0 another request.
//
//   Released released(call.request, writer);
//   switch (released.on_read(snapshot, now)) {
//     case Released::Found::request: …          // the program asks again
//
// Where a read has shown REQUEST_STATE 0 before the release, each later value that is not 0 is a
// new request. Where none has (a kernel that clears REQUEST_STATE itself), the request is over when
// REQUEST_STATE reads another value, or 0 and the gateway has not written it, or when
// RESPONSE_STATE reads 0 after it has read the state of the answer: the program's write of
// REQUEST_STATE sets it to 0 (documented, IB/tf5200_service_interface/356533387.html). Texts that
// differ prove that the program has gone on, not that its next request is complete.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/channel/answer_writer.hpp"

namespace millrace::gateway::channel {

class Released {
 public:
  /// `writer` is done.
  Released(PendingRequest request, const AnswerWriter& writer);

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
  /// A new connection.
  void on_link_up();

  [[nodiscard]] ReadSet reads() const { return whole_ ? ReadSet::all : ReadSet::states; }
  /// Nothing: like an idle channel.
  [[nodiscard]] std::optional<SteadyTime> read_at() const { return read_at_; }
  void read_now() { read_at_ = SteadyTime{}; }
  [[nodiscard]] Variable variable() const {
    return text_last_ ? Variable::response : Variable::response_state;
  }
  [[nodiscard]] Value value() const { return text_last_ ? Value(text_) : Value(state_); }

  /// Until when RESPONSE_STATE may still take effect, if no read has shown it yet. Empty if a read
  /// has, or if RESPONSE releases the NC program.
  [[nodiscard]] std::optional<SteadyTime> unseen_until() const {
    return text_last_ || state_seen_ ? std::nullopt : std::optional(sent_.last + takes_effect);
  }

  /// REQUEST_STATE was read as 0: the channel is idle, or has another request.
  [[nodiscard]] bool zero_seen() const { return zero_seen_; }
  [[nodiscard]] const PendingRequest& request() const { return request_; }
  /// Why it is not over; empty while there is no problem.
  [[nodiscard]] const fabric::Message& problem() const { return problem_; }

 private:
  Found decide(const ServiceSnapshot& snapshot, const ReadTime& time);
  Found decide_uncleared(const ServiceSnapshot& snapshot, const ReadTime& time);
  Found release_again(const ReadTime& time);

  PendingRequest request_;
  std::string text_;
  std::uint32_t state_ = 0;
  /// RESPONSE_STATE before the release: of an interim answer. As long as it stands, the release is
  /// not shown.
  std::uint32_t stood_ = 0;
  bool text_last_ = false;
  bool zero_seen_ = false;
  /// We have written 0: it is not a sign of a kernel that has taken the release.
  bool cleared_ = false;
  /// A read has shown what releases the program; and the state, which its next write of
  /// REQUEST_STATE sets to 0.
  bool release_seen_ = false;
  bool state_seen_ = false;
  Sent sent_;
  bool whole_ = false;
  std::optional<SteadyTime> read_at_{SteadyTime{}};
  /// Since when reads show what only a program that went on can have written.
  std::optional<SteadyTime> moved_on_;
  fabric::Message problem_;
};

}  // namespace millrace::gateway::channel
