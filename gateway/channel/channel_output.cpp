#include "gateway/channel/channel_output.hpp"

#include <tuple>
#include <utility>

#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

bool same(const fabric::ChannelStatus& a, const fabric::ChannelStatus& b) {
  const auto all = [](const fabric::ChannelStatus& s) {
    return std::tie(s.state, s.call, s.attempt, s.instance, s.uuid, s.reason, s.calls, s.answered,
                    s.withdrawn, s.repeated, s.late, s.failed);
  };
  return all(a) == all(b);
}

}  // namespace

void ChannelOutput::put(SessionAction action) {
  if (actions_.capacity() == 0 && commons_ != nullptr && !commons_->spare.empty()) {
    actions_ = std::move(commons_->spare.back());
    commons_->spare.pop_back();
  }
  if (actions_.capacity() == 0) {
    actions_.reserve(few_actions);
  }
  actions_.push_back(std::move(action));
}

EntryNumber ChannelOutput::record(JournalEntry entry) {
  put(Record{{Ticket::Owner::channel, key(), ++last_entry_}, std::move(entry)});
  return last_entry_;
}

void ChannelOutput::tell(fabric::Event event, Moment now) {
  if (!hears_events()) {
    return;
  }
  event.key = key();
  event.at = now.wall;
  event.detail = fit_reason(std::move(event.detail));
  put(Tell{std::move(event)});
}

void ChannelOutput::show(const ChannelView& view, Moment now) {
  note(view, now);
  if (commons_ != nullptr && !interest().statuses) {
    shown_.reset();
  } else if (!shown_ || !same(*shown_, status_)) {
    shown_ = status_;
    put(Show{status_});
  }
}

/// After each event, and most change nothing: compared before anything is copied.
void ChannelOutput::note(const ChannelView& view, Moment now) {
  if (std::exchange(fresh_, false) || view.state != status_.state || view.call != status_.call) {
    status_.since = now.wall;
  }
  status_.state = view.state;
  status_.call = view.call;
  status_.attempt = view.attempt;
  status_.instance = view.instance;
  if (status_.uuid != view.uuid) {
    status_.uuid = view.uuid;
  }
  if (status_.reason != view.reason) {
    status_.reason = fit_reason(std::string(view.reason));
  }
}

void ChannelOutput::show_idle(const std::string& reason, Moment now) {
  fabric::ChannelStatus last = status_;
  last.state = fabric::ChannelState::idle;
  last.call = {};
  last.since = now.wall;
  last.reason = reason;
  put(Show{std::move(last)});
}

}  // namespace millrace::gateway::channel
