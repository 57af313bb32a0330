// What a part of a program says troubles it, for a test to look at.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "fabric/notice_sink.hpp"

namespace millrace::tests {

/// From any thread.
class KeptNotices final : public fabric::NoticeSink {
 public:
  void raise(const fabric::Notice& notice) override {
    const std::lock_guard guard(lock_);
    kept_.insert_or_assign({notice.key.kind, notice.key.subject}, notice);
  }
  void clear(const std::string& kind, const std::string& subject) override {
    const std::lock_guard guard(lock_);
    kept_.erase({kind, subject});
  }

  [[nodiscard]] std::optional<fabric::Notice> of(const std::string& kind,
                                                 const std::string& subject = {}) const {
    const std::lock_guard guard(lock_);
    const auto found = kept_.find({kind, subject});
    return found == kept_.end() ? std::nullopt : std::optional(found->second);
  }
  [[nodiscard]] bool empty() const {
    const std::lock_guard guard(lock_);
    return kept_.empty();
  }

 private:
  mutable std::mutex lock_;
  std::map<std::pair<std::string, std::string>, fabric::Notice> kept_;
};

}  // namespace millrace::tests
