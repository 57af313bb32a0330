// The way of an answer into the channel.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "gateway/channel/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

/// A RESPONSE_STATE that stands beside the request, and so does not answer it, although we have not
/// written it: an interim state of another gateway, or what an earlier call has left.
bool stands_beside(const Snapshot& snapshot, const Call& call) {
  return snapshot.request_state != 0 && snapshot.response_state != 0 &&
         std::ranges::count(call.shown, snapshot.response_state) == 0;
}

}  // namespace

void ChannelSession::start_writer() {
  Active& active = *active_;
  if (active.writer) {
    return;
  }
  using Kind = AnswerWriter::Kind;
  if (active.call.answer) {
    if (active.answer_ticket == 0) {
      active.writer.emplace(Kind::final, active.call.answer->text, active.call.answer->state);
    }
  } else if (active.recorded_interim) {
    if (active.interim_ticket == 0) {
      const auto interim = *std::exchange(active.recorded_interim, std::nullopt);
      active.call.shown.push_back(interim.state);
      active.writer.emplace(Kind::interim, interim.text, interim.state);
    }
  } else if (active.interim) {
    active.recorded_interim = std::exchange(active.interim, std::nullopt);
    active.interim_ticket = record(InterimEntry{active.call.id, active.recorded_interim->state});
  }
}

bool ChannelSession::drive_writer(Moment now) {
  if (!active_) {
    return false;
  }
  start_writer();
  if (!active_->writer) {
    return false;
  }
  const AnswerWriter& writer = *active_->writer;
  switch (writer.next()) {
    case AnswerWriter::Step::look:
      read(writer.look(), Io::answer);
      return true;
    case AnswerWriter::Step::write_response:
      write(Variable::response, writer.text());
      return true;
    case AnswerWriter::Step::clear:
      write(Variable::request_state, std::uint32_t{0});
      return true;
    case AnswerWriter::Step::write_state:
      write(Variable::response_state, writer.state());
      return true;
    case AnswerWriter::Step::record_clearing:
      if (active_->clearing_ticket == 0) {
        active_->clearing_ticket = record(ClearingEntry{active_->call.id});
        due_ = now.steady + pace_.idle;
      }
      return false;
    case AnswerWriter::Step::done:
    case AnswerWriter::Step::dropped:
      return false;
  }
  return false;
}

void ChannelSession::answer_looked(const Snapshot& snapshot, Moment now) {
  looked_at_ = now.steady;
  if (other_can_see(snapshot)) {
    leave_to_the_other(now);
    return;
  }
  Call& call = active_->call;
  const Standing standing = judge(snapshot, call.request, call.shown);
  if (standing == Standing::pending && stands_beside(snapshot, call)) {
    // Once REQUEST_STATE is cleared it must not be taken for somebody's answer.
    call.shown.push_back(snapshot.response_state);
    record(InterimEntry{call.id, snapshot.response_state});
  }
  if (active_->writer->on_look(snapshot, standing, call.request) == AnswerWriter::Step::dropped) {
    end(false, why_over(standing, snapshot), now);
  } else {
    writer_finished(now);
  }
}

void ChannelSession::writer_finished(Moment now) {
  Active& active = *active_;
  if (active.writer->next() != AnswerWriter::Step::done) {
    return;
  }
  if (active.writer->kind() == AnswerWriter::Kind::final) {
    end(true, "", now);
    return;
  }
  fabric::Event event;
  event.kind = fabric::EventKind::interim;
  event.call = active.call.id;
  event.uuid = active.call.request.uuid;
  event.text = active.writer->text();
  event.state = active.writer->state();
  tell(std::move(event), now);
  active.call.shown.assign(1, active.writer->state());
  active.writer.reset();
}

}  // namespace millrace::gateway::channel
