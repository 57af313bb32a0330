// Which alarms are news: a program says each of its own again and again while it holds. Pure.
//
//   alarms.on_alarm(alarm)     news: the first time, or with another text
//   alarms.over(key)           the alarm with its last text
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "fabric/observer/entry.hpp"

namespace millrace::fabric::observer {

/// The key under which a reader keeps each alarm. The first writer of a key owns it. An alarm of
/// another writer with that key gets a key of its own, so it does not replace the first one.
class AlarmOwners {
 public:
  using Handle = std::uint64_t;

  struct Taken {
    /// The key under which the alarm is kept.
    AlarmKey key{};
    /// The writer has taken the alarm back.
    bool is_over = false;
  };
  /// What a sample of `writer` means; nothing if it has no meaning. `alive`: DDS does not say that
  /// the instance is disposed or without a writer. While several writers have the key, DDS does not
  /// say whose disposal that is, so a valid sample counts as an alarm.
  std::optional<Taken> take(const AlarmKey& key, Handle writer, bool valid, bool alive) {
    if (!alive && !(valid && is_shared(key))) {
      return Taken{over(key, writer), true};
    }
    return valid ? std::optional(Taken{on_alarm(key, writer)}) : std::nullopt;
  }

  /// `writer` has written this alarm. Returns the key under which it is kept.
  AlarmKey on_alarm(const AlarmKey& key, Handle writer) {
    const auto known = keys_.find(key);
    if (known == keys_.end()) {
      if (keys_.size() < most) {
        keys_.emplace(key, Writers{.owner = writer});
      }
      return key;
    }
    Writers& writers = known->second;
    if (writers.owner == writer) {
      return key;
    }
    if (!is_in(writers.others, writer)) {
      if (writers.owner == no_writer) {
        writers.owner = writer;
        return key;
      }
      if (writers.others.size() < most_others) {
        writers.others.push_back(writer);
      }
    }
    return beside(key, writer);
  }

  /// Several writers have written this key.
  [[nodiscard]] bool is_shared(const AlarmKey& key) const {
    const auto known = keys_.find(key);
    return known != keys_.end() && !known->second.others.empty();
  }

  /// `writer` has taken the alarm back. Returns the key under which it was kept.
  AlarmKey over(const AlarmKey& key, Handle writer) {
    const auto known = keys_.find(key);
    if (known == keys_.end()) {
      return key;
    }
    Writers& writers = known->second;
    const bool was_owner = writers.owner == writer;
    if (was_owner) {
      writers.owner = no_writer;
    } else {
      std::erase(writers.others, writer);
    }
    if (writers.owner == no_writer && writers.others.empty()) {
      keys_.erase(known);
    }
    return was_owner ? key : beside(key, writer);
  }

  /// The kept keys of writers that are not matched any more (`there`: those that are). Only for
  /// keys of several writers: DDS reports a lost writer only when the key has none left.
  std::vector<AlarmKey> gone(const std::vector<Handle>& there) {
    std::vector<std::pair<AlarmKey, Handle>> left;
    for (const auto& [key, writers] : keys_) {
      if (writers.others.empty()) {
        continue;
      }
      std::vector<Handle> all = writers.others;
      all.push_back(writers.owner);
      for (const Handle writer : all) {
        if (writer != no_writer && !is_in(there, writer)) {
          left.emplace_back(key, writer);
        }
      }
    }
    std::vector<AlarmKey> kept;
    kept.reserve(left.size());
    for (const auto& [key, writer] : left) {
      kept.push_back(over(key, writer));
    }
    return kept;
  }

 private:
  /// Far more than a fabric has.
  static constexpr std::size_t most = 16'384;
  static constexpr std::size_t most_others = 16;
  static constexpr Handle no_writer = 0;

  struct Writers {
    Handle owner = no_writer;
    std::vector<Handle> others{};
  };

  static bool is_in(const std::vector<Handle>& all, Handle handle) {
    return std::ranges::find(all, handle) != all.end();
  }
  static AlarmKey beside(AlarmKey key, Handle writer) {
    key.responder = {};
    std::memcpy(key.responder.bytes.data(), &writer, sizeof writer);
    return key;
  }

  std::map<AlarmKey, Writers> keys_;
};

class Alarms {
 public:
  /// Any participant can publish any number of alarms: beyond these each sample is news.
  static constexpr std::size_t most = 1'000;

  std::optional<AlarmNews> on_alarm(Alarm alarm) {
    const auto known = last_.find(alarm.key);
    if (known != last_.end() && known->second == alarm) {
      return std::nullopt;
    }
    if (known != last_.end() || last_.size() < most) {
      last_.insert_or_assign(alarm.key, alarm);
    }
    return AlarmNews{.alarm = std::move(alarm)};
  }

  std::optional<AlarmNews> over(const AlarmKey& key, bool is_lost = false) {
    AlarmNews news{.over = true, .alarm = {.key = key}, .lost = is_lost};
    if (auto known = last_.extract(key)) {
      news.alarm = std::move(known.mapped());
    }
    return news;
  }

 private:
  std::map<AlarmKey, Alarm> last_;
};

}  // namespace millrace::fabric::observer
