// Which notices are news: a program says each of its own again and again while it holds. Pure.
//
//   notices.said(notice)        the first time, or when it says something else
//   notices.over(key)           with what it said last
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

/// Under which key each notice is kept: its own if its writer is the first to say it, and another
/// one beside it where it stands in the place of what another writer says. So nobody changes or
/// hides a notice of another.
class NoticeOwners {
 public:
  using Handle = std::uint64_t;

  /// `writer` says the notice with this key.
  NoticeKey said(const NoticeKey& key, Handle writer) {
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
      if (writers.owner == nobody) {
        writers.owner = writer;
        return key;
      }
      if (writers.others.size() < most_others) {
        writers.others.push_back(writer);
      }
    }
    return beside(key, writer);
  }

  /// Whether several writers say it, so that DDS cannot tell which of them has taken it back while
  /// another one's sample waits.
  [[nodiscard]] bool is_shared(const NoticeKey& key) const {
    const auto known = keys_.find(key);
    return known != keys_.end() && !known->second.others.empty();
  }

  /// `writer` says it no more; under which key it was kept.
  NoticeKey over(const NoticeKey& key, Handle writer) {
    const auto known = keys_.find(key);
    if (known == keys_.end()) {
      return key;
    }
    Writers& writers = known->second;
    const bool was_owner = writers.owner == writer;
    if (was_owner) {
      writers.owner = nobody;
    } else {
      std::erase(writers.others, writer);
    }
    if (writers.owner == nobody && writers.others.empty()) {
      keys_.erase(known);
    }
    return was_owner ? key : beside(key, writer);
  }

  /// Notices with several writers, of those that are not `there` any more: DDS says nothing of a
  /// writer that is gone as long as there is another one for its key.
  std::vector<NoticeKey> gone(const std::vector<Handle>& there) {
    std::vector<std::pair<NoticeKey, Handle>> left;
    for (const auto& [key, writers] : keys_) {
      if (writers.others.empty()) {
        continue;
      }
      std::vector<Handle> all = writers.others;
      all.push_back(writers.owner);
      for (const Handle writer : all) {
        if (writer != nobody && !is_in(there, writer)) {
          left.emplace_back(key, writer);
        }
      }
    }
    std::vector<NoticeKey> over_now;
    over_now.reserve(left.size());
    for (const auto& [key, writer] : left) {
      over_now.push_back(over(key, writer));
    }
    return over_now;
  }

 private:
  /// Far more than troubles that there are.
  static constexpr std::size_t most = 16'384;
  static constexpr std::size_t most_others = 16;
  static constexpr Handle nobody = 0;

  struct Writers {
    Handle owner = nobody;
    std::vector<Handle> others{};
  };

  static bool is_in(const std::vector<Handle>& all, Handle one) {
    return std::ranges::find(all, one) != all.end();
  }
  static NoticeKey beside(NoticeKey key, Handle writer) {
    key.responder = {};
    std::memcpy(key.responder.bytes.data(), &writer, sizeof writer);
    return key;
  }

  std::map<NoticeKey, Writers> keys_;
};

class Notices {
 public:
  /// Whoever is on the fabric can say what he likes: beyond these each one is news each time.
  static constexpr std::size_t most = 1'000;

  std::optional<NoticeNews> said(Notice notice) {
    const auto known = last_.find(notice.key);
    if (known != last_.end() && known->second == notice) {
      return std::nullopt;
    }
    if (known != last_.end() || last_.size() < most) {
      last_.insert_or_assign(notice.key, notice);
    }
    return NoticeNews{.notice = std::move(notice)};
  }

  std::optional<NoticeNews> over(const NoticeKey& key) {
    NoticeNews news{.over = true, .notice = {.key = key}};
    if (auto known = last_.extract(key)) {
      news.notice = std::move(known.mapped());
    }
    return news;
  }

 private:
  std::map<NoticeKey, Notice> last_;
};

}  // namespace millrace::fabric::observer
