// Which notices are news: a program says each of its own again and again while it holds. Pure.
//
//   notices.said(notice)        the first time, or when it says something else
//   notices.over(key)           with what it said last
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "fabric/observer/entry.hpp"

namespace millrace::fabric::observer {

/// Whose each notice is: who has said it first, while that writer is there.
class NoticeOwners {
 public:
  using Handle = std::uint64_t;

  bool is_own(const NoticeKey& key, Handle writer, const std::vector<Handle>& there) {
    const auto known = owners_.find(key);
    if (known == owners_.end()) {
      if (owners_.size() < most) {
        owners_.emplace(key, writer);
      }
      return true;
    }
    if (known->second != writer && std::ranges::find(there, known->second) == there.end()) {
      known->second = writer;
    }
    return known->second == writer;
  }
  /// It has been taken back.
  void forget(const NoticeKey& key) { owners_.erase(key); }

 private:
  /// Far more than troubles that there are.
  static constexpr std::size_t most = 16'384;

  std::map<NoticeKey, Handle> owners_;
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
