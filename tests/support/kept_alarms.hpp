// Keeps the alarms of one part of a program, for a test to check.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "fabric/alarm.hpp"

namespace millrace::tests {

/// From any thread.
class KeptAlarms final : public fabric::AlarmSink {
 public:
  void raise(const fabric::Alarm& alarm) override {
    const std::lock_guard guard(lock_);
    kept_.insert_or_assign({alarm.key.kind, alarm.key.subject}, alarm);
  }
  void clear(const std::string& kind, const std::string& subject) override {
    const std::lock_guard guard(lock_);
    kept_.erase({kind, subject});
  }

  [[nodiscard]] std::optional<fabric::Alarm> of(const std::string& kind,
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
  std::map<std::pair<std::string, std::string>, fabric::Alarm> kept_;
};

}  // namespace millrace::tests
