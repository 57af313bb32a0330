#include "gateway/channel/channel_output.hpp"

#include <tuple>
#include <utility>

#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

bool same_counters(const fabric::ChannelStatus& a, const fabric::ChannelStatus& b) {
  const auto all = [](const fabric::ChannelStatus& s) {
    return std::tie(s.calls, s.answered, s.withdrawn, s.repeated, s.late, s.failed);
  };
  return all(a) == all(b);
}

/// `shown` is `reason`, as far as that fits.
bool same_reason(const std::string& shown, std::string_view reason) {
  return shown == reason || shown == fit_reason(std::string(reason));
}

/// After each event, and most change nothing: compared before anything is copied.
bool same(const fabric::ChannelStatus& shown, const ChannelView& view) {
  return shown.state == view.state && shown.call == view.call && shown.attempt == view.attempt &&
         shown.instance == view.instance && shown.uuid == view.uuid &&
         same_reason(shown.reason, view.reason);
}

}  // namespace

void ChannelOutput::put(SessionAction action) {
  if (actions_.capacity() == 0) {
    actions_.reserve(few_actions);
  }
  actions_.push_back(std::move(action));
}

Ticket ChannelOutput::record(JournalEntry entry) {
  put(Record{++last_ticket_, std::move(entry)});
  return last_ticket_;
}

void ChannelOutput::tell(fabric::Event event, Moment now) {
  event.key = key();
  event.at = now.wall;
  event.detail = fit_reason(std::move(event.detail));
  put(Tell{std::move(event)});
}

void ChannelOutput::show(const ChannelView& view, Moment now) {
  if (shown_ && same_counters(*shown_, status_) && same(*shown_, view)) {
    return;
  }
  if (!shown_ || view.state != shown_->state || view.call != shown_->call) {
    status_.since = now.wall;
  }
  status_.state = view.state;
  status_.reason = fit_reason(std::string(view.reason));
  status_.call = view.call;
  status_.uuid = view.uuid;
  status_.attempt = view.attempt;
  status_.instance = view.instance;
  shown_ = status_;
  put(Show{status_});
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
