// Which notices are news: a program says each of its own again and again while it holds. Pure.
//
//   notices.said(notice)        the first time, or when it says something else
//   notices.over(key)           with what it said last
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "fabric/observer/entry.hpp"

namespace millrace::fabric::observer {

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
