#include "tools/recording/hops.hpp"

namespace millrace::tools::recording {

std::string_view name_of(Hop hop) {
  constexpr std::array<std::string_view, hop_count> names{
      "dispatch", "to service", "queue", "work", "to gateway", "write back", "total"};
  return names.at(static_cast<std::size_t>(hop));
}

void HopStatistics::add(const Entry& entry) {
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    Open& call = open(request->call);
    call.uuid = entry.uuid;
    call.seen = request->seen;
    call.dispatched = request->dispatched;
    finish_if_whole(request->call);
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    if (reply->kind == fabric::ReplyKind::final) {
      Open& call = open(reply->call);
      call.received = reply->received;
      call.started = reply->started;
      call.answered = reply->answered;
      finish_if_whole(reply->call);
    }
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    add(*event, entry.uuid);
  }
  forget_oldest();
}

void HopStatistics::add(const fabric::Event& event, const std::string& uuid) {
  switch (event.kind) {
    case fabric::EventKind::seen:
      open(event.call).uuid = uuid;
      open(event.call).seen = event.at;
      break;
    case fabric::EventKind::replied:
      open(event.call).replied = event.at;
      break;
    case fabric::EventKind::written:
      open(event.call).written = event.at;
      finish_if_whole(event.call);
      break;
    case fabric::EventKind::withdrawn:
      if (const auto call = open_.find(event.call); call != open_.end()) {
        close(call);
      }
      break;
    default:
      break;
  }
}

void HopStatistics::close() {
  for (const auto& [id, call] : open_) {
    count(call);
  }
  open_.clear();
  turns_.clear();
}

HopStatistics::Open& HopStatistics::open(const fabric::CallId& id) {
  const auto [call, is_new] = open_.try_emplace(id);
  if (is_new) {
    call->second.turn = next_turn_++;
    turns_.emplace(call->second.turn, id);
  }
  return call->second;
}

void HopStatistics::close(OpenCalls::iterator call) {
  turns_.erase(call->second.turn);
  open_.erase(call);
}

void HopStatistics::finish_if_whole(fabric::CallId id) {
  const auto call = open_.find(id);
  if (call->second.written != fabric::Time{} && call->second.answered != fabric::Time{} &&
      call->second.dispatched != fabric::Time{}) {
    count(call->second);
    close(call);
  }
}

void HopStatistics::forget_oldest() {
  // More than all channels have running; older ones wait for samples that were lost.
  constexpr std::size_t most = 4096;
  if (open_.size() > most) {
    const auto oldest = open_.find(turns_.begin()->second);
    count(oldest->second);
    close(oldest);
  }
}

void HopStatistics::count(const Open& call) {
  if (call.written == fabric::Time{} || call.uuid.empty()) {
    return;
  }
  measure(call.uuid, Hop::dispatch, call.seen, call.dispatched);
  measure(call.uuid, Hop::to_service, call.dispatched, call.received);
  measure(call.uuid, Hop::queue, call.received, call.started);
  measure(call.uuid, Hop::work, call.started, call.answered);
  measure(call.uuid, Hop::to_gateway, call.answered, call.replied);
  measure(call.uuid, Hop::write_back, call.replied, call.written);
  measure(call.uuid, Hop::total, call.seen, call.written);
}

/// Counts the way between two times if both are known.
void HopStatistics::measure(const std::string& uuid, Hop hop, fabric::Time from, fabric::Time to) {
  if (from == fabric::Time{} || to == fabric::Time{}) {
    return;
  }
  if (use_) {
    use_(uuid, hop, to - from);
  } else {
    services_[uuid].at(static_cast<std::size_t>(hop)).add(to - from);
  }
}

}  // namespace millrace::tools::recording
