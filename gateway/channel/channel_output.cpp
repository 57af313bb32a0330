#include "gateway/channel/channel_output.hpp"

#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::channel {

void BlockedChannels::note(const fabric::ChannelStatus& status, bool begins, Moment now) {
  using enum fabric::ChannelState;
  if (status.state == held || status.state == unserved) {
    if (begins && of(status) == nullptr) {
      BlockedEntry entry{.key = status.key,
                         .state = status.state,
                         .call = status.call,
                         .uuid = status.uuid,
                         .since = now.wall,
                         .reason = status.reason};
      records_.append(entry, {});
      entries_.insert_or_assign(status.key, std::move(entry));
    }
  } else if (const auto found = entries_.find(status.key); found != entries_.end() &&
                                                           status.call != fabric::CallId{} &&
                                                           status.call != found->second.call) {
    forget(status.key);
  }
}

void BlockedChannels::forget(const fabric::ChannelKey& key) {
  if (!entries_.empty() && entries_.erase(key) != 0) {
    records_.append(BlockedEntry{.key = key}, {});
  }
}

const BlockedEntry* BlockedChannels::of(const fabric::ChannelStatus& status) const {
  const auto found = entries_.find(status.key);
  const bool same = found != entries_.end() && found->second.state == status.state &&
                    found->second.call == status.call && found->second.uuid == status.uuid;
  return same ? &found->second : nullptr;
}

namespace {

bool same(const fabric::ChannelStatus& a, const fabric::ChannelStatus& b) {
  const auto all = [](const fabric::ChannelStatus& s) {
    return std::tie(s.state, s.call, s.attempt, s.instance, s.uuid, s.reason, s.calls, s.answered,
                    s.withdrawn, s.repeated, s.late, s.failed);
  };
  return all(a) == all(b);
}

}  // namespace

EntryNumber ChannelOutput::append(const JournalEntry& entry) {
  context_.records.append(entry, {Ticket::Owner::channel, key(), ++context_.last_entry});
  return context_.last_entry;
}

void ChannelOutput::log(Level level, const std::string& text) {
  if (wanted(level)) {
    context_.records.log(level, fmt::format("{}: {}", key().to_string(), text));
  }
}

void ChannelOutput::report_write_problem(const fabric::Message& problem) {
  if (write_problem_ != problem) {
    write_problem_ = problem;
    context_.records.set_alarm(
        {.kind = "write", .subject = key().to_string()},
        problem.empty() ? problem : base::messages::about(key().to_string(), problem),
        base::messages::check_controller());
  }
}

void ChannelOutput::publish(fabric::Request request) {
  context_.answered.replace(key_of(request));
  if (const auto before = context_.predecessor_epochs.find(key());
      before != context_.predecessor_epochs.end()) {
    request.succeeds = before->second;
  }
  context_.fabric.publish(request);
  news_.published = request.call;
}

void ChannelOutput::withdraw(const fabric::InstanceId& instance, const fabric::CallId& call) {
  const fabric::RequestKey request{key(), call.epoch, instance};
  context_.answered.replace(request);
  context_.fabric.dispose(request);
}

void ChannelOutput::publish(fabric::Event event, Moment now) {
  if (!events_wanted()) {
    return;
  }
  event.key = key();
  event.at = now.wall;
  context_.fabric.publish(event);
}

void ChannelOutput::publish_status(const ChannelView& view, Moment now) {
  update(view, now);
  if (!context_.readers.statuses) {
    published_.reset();
  } else if (!published_ || !same(*published_, status_)) {
    published_ = status_;
    publish(status_);
  }
}

/// After each event, and most change nothing: compared before anything is copied.
void ChannelOutput::update(const ChannelView& view, Moment now) {
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
  if (status_.reason != *view.reason) {
    status_.reason = *view.reason;
  }
}

void ChannelOutput::publish_idle(const fabric::Message& reason, Moment now) {
  fabric::ChannelStatus last = status_;
  last.state = fabric::ChannelState::idle;
  last.call = {};
  last.since = now.wall;
  last.reason = reason;
  publish(last);
}

void ChannelOutput::publish(const fabric::ChannelStatus& status) {
  const BlockedEntry* const blocked = context_.blocked.of(status);
  if (blocked == nullptr) {
    context_.fabric.publish(status);
    return;
  }
  fabric::ChannelStatus since_then = status;
  since_then.since = blocked->since;
  if (blocked->state == fabric::ChannelState::held) {
    // Only the gateway that saw the loss can name the lost instance.
    since_then.reason = base::messages::held_too_long.is(status.reason)
                            ? base::messages::held_too_long(blocked->reason)
                            : blocked->reason;
  }
  context_.fabric.publish(since_then);
}

}  // namespace millrace::gateway::channel
