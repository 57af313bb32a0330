#include "gateway/channel/answer_writer.hpp"

#include <cassert>
#include <utility>

namespace millrace::gateway::channel {

AnswerWriter AnswerWriter::resumed(Response response, bool clearing) {
  AnswerWriter writer(Kind::final, std::move(response));
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
  const bool complete = unsure_ && response_written_ && snapshot.response_state == state();
  if (kind_ == Kind::interim) {
    const bool shown = complete && standing == Standing::pending;
    next_ =
        shown ? Step::done : (standing == Standing::pending ? Step::write_response : Step::dropped);
  } else {
    next_ =
        complete && request_state_zero_ ? Step::done : decide_final(snapshot, standing, request);
    if (next_ == Step::write_state && release_tried_ && !std::exchange(unreleased_, true)) {
      // A program that was released and asks anew clears RESPONSE_STATE between two reads of one
      // look. A second look finds its new REQUEST_STATE.
      next_ = Step::look;
    } else {
      unreleased_ = false;
    }
  }
  return next_;
}

AnswerWriter::Step AnswerWriter::decide_final(const Snapshot& snapshot, Standing standing,
                                              const PendingRequest& request) const {
  // The program asks again after a clear that the controller confirmed: it has moved on.
  const Step moved_on = release_tried_ ? Step::done : Step::dropped;
  switch (standing) {
    case Standing::pending:
      if (cleared_ && !request_state_zero_) {
        return moved_on;
      }
      return response_written_ ? after_response() : Step::write_response;
    case Standing::cleared: {
      const bool same_texts = snapshot.uuid == request.uuid && snapshot.request == request.text;
      // With the journal's word that we cleared it, and our text still there, the program waits.
      return clear_tried_ && same_texts && response_written_ ? Step::write_state : Step::dropped;
    }
    case Standing::replaced:
      return moved_on;
    case Standing::answered:
      return Step::dropped;
  }
  return Step::dropped;
}

AnswerWriter::Step AnswerWriter::after_response() const {
  if (request_state_zero_) {
    return Step::write_state;
  }
  return clearing_ ? Step::clear : Step::record_clearing;
}

AnswerWriter::Step AnswerWriter::on_written() {
  switch (next_) {
    case Step::write_response:
      response_written_ = true;
      next_ = kind_ == Kind::interim ? Step::write_state : after_response();
      break;
    case Step::clear:
      clear_tried_ = true;
      cleared_ = true;
      next_ = Step::write_state;
      break;
    case Step::write_state:
      next_ = Step::done;
      break;
    default:
      assert(false && "no write was asked for");
  }
  return next_;
}

AnswerWriter::Step AnswerWriter::on_unknown() {
  unsure_ = true;
  clear_tried_ = clear_tried_ || next_ == Step::clear;
  release_tried_ = release_tried_ || next_ == Step::write_state;
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
