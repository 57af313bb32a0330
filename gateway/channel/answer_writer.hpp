// Brings one answer into a channel: which step comes next, decided from what the channel shows.
//
//   AnswerWriter writer(AnswerWriter::Kind::final, response);
//   writer.next()                       → Step::look
//   writer.on_look(snapshot, standing)   → Step::write_response
//   writer.on_written()                 → Step::record_clearing → clear → write_state → done
//
// A final answer is written as RESPONSE, then REQUEST_STATE = 0, then RESPONSE_STATE. The last
// write releases the program, which may issue its next request at once; clearing REQUEST_STATE
// after that could wipe the new request, and a kernel that clears RESPONSE_STATE whenever
// REQUEST_STATE is written (documented for the program's writes, not for others) would wipe the
// answer.
//
// A program that waits for a text in RESPONSE and looks at no state (fabric::Awaited) is released
// by RESPONSE, so that is written last: REQUEST_STATE = 0, RESPONSE_STATE, then RESPONSE. Such a
// program empties RESPONSE before it asks; what of its answer is 0 already is not written.
//
// An interim answer is RESPONSE and RESPONSE_STATE only. On a kernel of the kind just named, a
// program that waits with SysServiceWait and @P1 = interim state may see RESPONSE_STATE 0 for the
// moment between the last two writes of the final answer; it must take 0 as "not yet".
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "gateway/response.hpp"
#include "gateway/snapshot.hpp"

namespace millrace::gateway::channel {

class AnswerWriter {
 public:
  enum class Kind : std::uint8_t { interim, final };

  enum class Step : std::uint8_t {
    /// Read the request again (see look()).
    look,
    write_response,
    /// Journal that REQUEST_STATE is about to be cleared, then on_recorded().
    record_clearing,
    clear,
    write_state,
    /// The answer stands in the channel, or the program has read it and moved on.
    done,
    /// The program withdrew or changed the request, or somebody else answered it: drop the answer.
    dropped,
  };

  AnswerWriter(Kind kind, Response response,
               fabric::Awaited awaited = fabric::Awaited::response_state)
      : kind_(kind),
        text_last_(awaited == fabric::Awaited::response),
        response_(std::move(response)) {}
  /// A final answer an earlier run of the gateway may have begun to write; `clearing` if the
  /// journal says that it was about to clear REQUEST_STATE.
  static AnswerWriter resumed(Response response, bool clearing,
                              fabric::Awaited awaited = fabric::Awaited::response_state);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] Step next() const { return next_; }
  [[nodiscard]] const std::string& text() const { return response_.text(); }
  [[nodiscard]] std::uint32_t state() const { return response_.state(); }
  /// What a look must take in: all, once a write of unknown outcome may have changed the channel,
  /// or the first write is done and must still be there.
  [[nodiscard]] ReadSet look() const {
    return unsure_ || response_written_ || clear_tried_ ? ReadSet::all : ReadSet::request;
  }

  /// `standing` is what judge() says of this snapshot.
  Step on_look(const Snapshot& snapshot, Standing standing, const PendingRequest& request);
  /// The controller confirmed the write that next() named.
  Step on_written();
  /// Nobody knows whether the write took place: timeout, link lost. It is never repeated blindly.
  Step on_unknown();
  /// The journal holds what record_clearing asked for. `fresh` if the last look is recent enough to
  /// trust for one more write; otherwise the request is looked at once more.
  Step on_recorded(bool fresh);
  /// Nothing was written, and what the last look said has aged: the controller refused, the link
  /// was down.
  Step look_again();

 private:
  [[nodiscard]] Step decide_final(const Snapshot& snapshot, Standing standing,
                                  const PendingRequest& request) const;
  [[nodiscard]] Step decide_text_last(const Snapshot& snapshot, Standing standing,
                                      const PendingRequest& request) const;
  /// The program asks anew, or again after a clear that the controller confirmed.
  [[nodiscard]] Step moved_on() const;
  [[nodiscard]] Step clear() const;
  /// RESPONSE is last, REQUEST_STATE is 0.
  [[nodiscard]] Step after_clear() const;
  /// The write that releases the program.
  [[nodiscard]] Step release() const {
    return text_last_ ? Step::write_response : Step::write_state;
  }

  Kind kind_;
  bool text_last_ = false;
  Response response_;
  Step next_ = Step::look;
  /// REQUEST_STATE already reads 0 (a kernel that cleared it after an interim answer).
  bool request_state_zero_ = false;
  bool response_written_ = false;
  /// RESPONSE_STATE read as the answer has it.
  bool state_stands_ = false;
  /// The journal knows that REQUEST_STATE is being cleared.
  bool clearing_ = false;
  bool clear_tried_ = false;
  bool cleared_ = false;
  bool release_tried_ = false;
  /// A look has shown that a release of unknown outcome did not take place; the next must, too.
  bool unreleased_ = false;
  /// A write of unknown outcome lies behind us.
  bool unsure_ = false;
};

}  // namespace millrace::gateway::channel
