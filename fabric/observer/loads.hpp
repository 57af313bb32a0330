// Which of the heartbeats' loads are news: heartbeats come several times a second, and mostly say
// the same. Pure.
#pragma once

#include <map>

#include "fabric/messages.hpp"
#include "fabric/moment.hpp"

namespace millrace::fabric::observer {

class Loads {
 public:
  /// Of an instance nothing is news more often than this. A change is in more heartbeats than fit
  /// into it (fabric/registry/heartbeats.hpp), so that the last one is not missed.
  static constexpr std::chrono::milliseconds pause{1000};

  /// True the first time, and when it is another one than the last that was news.
  bool is_news(const InstanceStatus& status, SteadyTime now) {
    const auto [last, is_first] = last_.try_emplace(status.instance, Last{status, now});
    if (is_first) {
      return true;
    }
    if (last->second.status == status || now - last->second.at < pause) {
      return false;
    }
    last->second = {status, now};
    return true;
  }

  void forget(const InstanceId& instance) { last_.erase(instance); }

 private:
  struct Last {
    InstanceStatus status;
    SteadyTime at;
  };
  std::map<InstanceId, Last> last_;
};

}  // namespace millrace::fabric::observer
