#include "tools/recording/call_follower.hpp"

namespace millrace::tools::recording {

namespace {

using fabric::EventKind;

bool concerns_an_attempt(EventKind kind) {
  return kind != EventKind::seen && kind != EventKind::unserved && kind != EventKind::late;
}

}  // namespace

std::optional<std::chrono::nanoseconds> FollowedCall::duration() const {
  if (seen == fabric::Time{} || ended == fabric::Time{}) {
    return std::nullopt;
  }
  return ended - seen;
}

std::optional<FollowedCall> CallFollower::add(const Entry& entry) {
  if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    return add(*event);
  }
  if (const auto* news = std::get_if<InstanceNews>(&entry.sample)) {
    // Instances that are gone are kept: their last calls may end later.
    if (news->change != Change::gone) {
      instances_.insert_or_assign(news->identity.id,
                                  Instance{news->identity.name, news->identity.host});
    }
  }
  return std::nullopt;
}

std::optional<FollowedCall> CallFollower::add(const fabric::Event& event) {
  if (event.call == fabric::CallId{}) {
    return std::nullopt;  // A request without a service is not a call yet.
  }
  FollowedCall& call = under_way_[event.key];
  if (call.id != event.call) {
    call = FollowedCall{.id = event.call, .key = event.key};
  }
  call.uuid = fabric::canonical_uuid(event.uuid);
  call.last = event.kind;
  call.detail = event.detail;
  call.replayed = call.replayed || event.replayed;
  if (concerns_an_attempt(event.kind)) {
    call.attempt = event.attempt;
    call.instance = event.instance;
    name_instance(call);
  }
  if (event.kind == EventKind::seen) {
    call.request = event.text;
    call.request_state = event.state;
    call.seen = event.at;
  }
  if (event.kind != EventKind::written && event.kind != EventKind::withdrawn) {
    return std::nullopt;
  }
  call.ended = event.at;
  if (event.kind == EventKind::written) {
    call.response = event.text;
    call.response_state = event.state;
  }
  FollowedCall ended = std::move(call);
  under_way_.erase(event.key);
  return ended;
}

void CallFollower::name_instance(FollowedCall& call) const {
  const auto known = instances_.find(call.instance);
  call.instance_name = known == instances_.end() ? std::string() : known->second.name;
  call.host = known == instances_.end() ? std::string() : known->second.host;
}

}  // namespace millrace::tools::recording
