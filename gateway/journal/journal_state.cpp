#include "gateway/journal/journal_state.hpp"

#include <algorithm>
#include <ranges>
#include <set>
#include <type_traits>

namespace millrace::gateway::journal {

namespace {

/// The newest may not have been written; then the channel still shows the one before.
void show(CallRecord& call, std::uint32_t state) {
  if (call.shown.size() > 1) {
    call.shown.erase(call.shown.begin());
  }
  call.shown.push_back(state);
}

}  // namespace

void JournalState::apply(const JournalEntry& entry) {
  if (const auto* numbers = std::get_if<NumbersEntry>(&entry)) {
    numbers_ = *numbers;
    return;
  }
  if (const auto* dispatched = std::get_if<DispatchedEntry>(&entry)) {
    open(*dispatched);
    return;
  }
  if (const auto* blocked = std::get_if<BlockedEntry>(&entry)) {
    if (blocked->state == fabric::ChannelState::idle) {
      blocked_.erase(blocked->key);
    } else {
      blocked_.insert_or_assign(blocked->key, *blocked);
    }
    return;
  }
  std::visit(
      [this](const auto& change) {
        using T = std::decay_t<decltype(change)>;
        if constexpr (std::is_same_v<T, MessageEndedEntry>) {
          end(change);
        } else if constexpr (std::is_same_v<T, MessageEntry> || std::is_same_v<T, LastGetEntry>) {
          queues_[change.key].apply(change);
        } else if constexpr (!std::is_same_v<T, NumbersEntry> && !std::is_same_v<T, BlockedEntry>) {
          const auto found = calls_.find(change.call);
          if (found == calls_.end()) {
            return;
          }
          CallRecord& call = found->second;
          if constexpr (std::is_same_v<T, InterimEntry>) {
            show(call, change.state);
          } else if constexpr (std::is_same_v<T, AnsweredEntry>) {
            call.answer = change.answer;
          } else if constexpr (std::is_same_v<T, ClearingEntry>) {
            call.clearing = true;
          } else if constexpr (std::is_same_v<T, EndedEntry>) {
            calls_.erase(found);
          }
        }
      },
      entry);
}

/// The end of the message is the end of its call, which may not have been written any more.
void JournalState::end(const MessageEndedEntry& entry) {
  queues_[entry.key].apply(entry);
  std::erase_if(calls_, [&](const auto& call) {
    return call.second.key == entry.key &&
           call.second.request.state == request_state_of(entry.number);
  });
}

void JournalState::open(const DispatchedEntry& entry) {
  CallRecord& call = calls_[entry.call];
  call.id = entry.call;
  call.key = entry.key;
  call.request = entry.request;
  call.seen = entry.seen;
  call.delivery = entry.delivery;
  call.completion_signal = entry.completion_signal;
  call.attempts.push_back({entry.instance, entry.attempt});
}

std::vector<CallRecord> JournalState::open_calls() const {
  std::vector<CallRecord> calls;
  std::set<fabric::ChannelKey> seen;
  // A channel has one call at a time: a later one means that the end of the earlier one was lost.
  for (const auto& [id, call] : std::views::reverse(calls_)) {
    if (seen.insert(call.key).second) {
      calls.push_back(call);
    }
  }
  std::ranges::reverse(calls);
  return calls;
}

std::vector<JournalEntry> JournalState::snapshot() const {
  std::vector<JournalEntry> entries{numbers_};
  for (const auto& [key, queue_log] : queues_) {
    const auto of_queue = queue_log.snapshot(key);
    entries.insert(entries.end(), of_queue.begin(), of_queue.end());
  }
  for (const CallRecord& call : open_calls()) {
    for (const Attempt& attempt : call.attempts) {
      entries.emplace_back(call.dispatched(attempt));
    }
    for (const std::uint32_t state : call.shown) {
      entries.emplace_back(InterimEntry{call.id, state});
    }
    if (call.answer) {
      entries.emplace_back(AnsweredEntry{call.id, *call.answer});
    }
    if (call.clearing) {
      entries.emplace_back(ClearingEntry{call.id});
    }
  }
  for (const auto& [key, blocked] : blocked_) {
    entries.emplace_back(blocked);
  }
  return entries;
}

}  // namespace millrace::gateway::journal
