#include "gateway/channel/answer_writer.hpp"

#include <cassert>
#include <utility>

namespace millrace::gateway::channel {

AnswerWriter AnswerWriter::resumed(Response response, bool clearing, fabric::Awaited awaited) {
  AnswerWriter writer(Kind::final, std::move(response), awaited);
  writer.unsure_ = true;
  writer.clearing_ = clearing;
  writer.clear_tried_ = clearing;
  writer.release_tried_ = clearing;
  return writer;
}

AnswerWriter::Step AnswerWriter::on_look(const Snapshot& snapshot, Standing standing,
                                         const PendingRequest& request) {
  assert(next_ == Step::look && snapshot.look == look());
  if (snapshot.has(Variable::response)) {
    response_written_ = snapshot.response == text();
  }
  request_state_zero_ = snapshot.request_state == 0;
  state_stands_ = snapshot.response_state == state();
  const bool complete = unsure_ && response_written_ && state_stands_;
  if (kind_ == Kind::interim) {
    const bool shown = complete && standing == Standing::pending;
    next_ =
        shown ? Step::done : (standing == Standing::pending ? Step::write_response : Step::dropped);
  } else {
    next_ = complete && request_state_zero_ ? Step::done
            : text_last_                    ? decide_text_last(snapshot, standing, request)
                                            : decide_final(snapshot, standing, request);
    if (next_ == release() && release_tried_ && !std::exchange(unreleased_, true)) {
      // A program that was released and asks anew clears RESPONSE_STATE, or empties RESPONSE,
      // between two reads of one look. A second look finds its new REQUEST_STATE, or its new texts.
      next_ = Step::look;
    } else {
      unreleased_ = false;
    }
  }
  return next_;
}

AnswerWriter::Step AnswerWriter::decide_final(const Snapshot& snapshot, Standing standing,
                                              const PendingRequest& request) const {
  switch (standing) {
    case Standing::pending:
      if (cleared_ && !request_state_zero_) {
        return moved_on();
      }
      return response_written_ ? clear() : Step::write_response;
    case Standing::cleared: {
      const bool same_texts = snapshot.uuid == request.uuid && snapshot.request == request.text;
      // With the journal's word that we cleared it, and our text still there, the program waits.
      return clear_tried_ && same_texts && response_written_ ? Step::write_state : Step::dropped;
    }
    case Standing::replaced:
      return moved_on();
    case Standing::answered:
      return Step::dropped;
  }
  return Step::dropped;
}

AnswerWriter::Step AnswerWriter::decide_text_last(const Snapshot& snapshot, Standing standing,
                                                  const PendingRequest& request) const {
  const bool same_texts = snapshot.uuid == request.uuid && snapshot.request == request.text;
  // With the journal's word that we cleared it, and its own texts still there, the program waits:
  // it writes the next ones before it empties RESPONSE.
  const bool waits = clear_tried_ && same_texts;
  switch (standing) {
    case Standing::pending:
      if (cleared_ && !request_state_zero_) {
        return moved_on();
      }
      return clear();
    case Standing::cleared:
      return waits ? after_clear() : Step::dropped;
    case Standing::answered:
      // By us, but for the text.
      return waits && state_stands_ ? after_clear() : Step::dropped;
    case Standing::replaced:
      return moved_on();
  }
  return Step::dropped;
}

AnswerWriter::Step AnswerWriter::moved_on() const {
  return release_tried_ ? Step::done : Step::dropped;
}

AnswerWriter::Step AnswerWriter::clear() const {
  if (request_state_zero_) {
    return text_last_ ? after_clear() : Step::write_state;
  }
  return clearing_ ? Step::clear : Step::record_clearing;
}

AnswerWriter::Step AnswerWriter::after_clear() const {
  return state_stands_ ? Step::write_response : Step::write_state;
}

AnswerWriter::Step AnswerWriter::on_written() {
  switch (next_) {
    case Step::write_response:
      response_written_ = true;
      if (text_last_) {
        next_ = Step::done;
      } else {
        next_ = kind_ == Kind::interim ? Step::write_state : clear();
      }
      break;
    case Step::clear:
      clear_tried_ = true;
      cleared_ = true;
      // Clearing it may have set RESPONSE_STATE to 0, but to nothing else.
      state_stands_ = state_stands_ && state() == 0;
      next_ = text_last_ ? after_clear() : Step::write_state;
      break;
    case Step::write_state:
      next_ = text_last_ ? Step::write_response : Step::done;
      break;
    default:
      assert(false && "no write was asked for");
  }
  return next_;
}

AnswerWriter::Step AnswerWriter::on_unknown() {
  unsure_ = true;
  clear_tried_ = clear_tried_ || next_ == Step::clear;
  release_tried_ = release_tried_ || next_ == release();
  next_ = Step::look;
  return next_;
}

AnswerWriter::Step AnswerWriter::on_recorded(bool fresh) {
  assert(next_ == Step::record_clearing);
  clearing_ = true;
  next_ = fresh ? Step::clear : Step::look;
  return next_;
}

AnswerWriter::Step AnswerWriter::look_again() {
  if (next_ != Step::done && next_ != Step::dropped) {
    next_ = Step::look;
  }
  return next_;
}

}  // namespace millrace::gateway::channel
