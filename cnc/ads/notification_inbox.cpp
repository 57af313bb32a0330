#include "cnc/ads/notification_inbox.hpp"

namespace millrace::cnc::ads {

void NotificationInbox::add(std::uint16_t port, const std::vector<std::uint32_t>& handles,
                            const NotificationHandler& handler) {
  const auto receiver = std::make_shared<const NotificationHandler>(handler);
  for (std::size_t item = 0; item < handles.size(); ++item) {
    if (handles[item] != 0) {
      const Handle handle{port, handles[item]};
      receivers_.insert_or_assign(handle, Receiver{receiver, item});
      known_strangers_.erase(handle);
    }
  }
  --expected_;
  // Samples for other pending requests stay held.
  std::vector<Held> kept;
  for (Held& early : std::exchange(held_, {})) {
    if (const auto found = receivers_.find(early.handle); found != receivers_.end()) {
      pass_on(found->second, early.value);
    } else if (expected_ > 0) {
      kept.push_back(std::move(early));
    } else {
      strange(early.handle);
    }
  }
  held_ = std::move(kept);
}

void NotificationInbox::remove(std::uint16_t port, const std::vector<std::uint32_t>& handles) {
  for (const std::uint32_t number : handles) {
    const Handle handle{port, number};
    if (receivers_.erase(handle) > 0 && known_strangers_.size() < most) {
      known_strangers_.insert(handle);
    }
  }
}

void NotificationInbox::receive(std::uint16_t port, const std::vector<Stamp>& stamps) {
  for (const Stamp& stamp : stamps) {
    for (const Sample& sample : stamp.samples) {
      const Handle handle{port, sample.handle};
      if (const auto found = receivers_.find(handle); found != receivers_.end()) {
        pass_on(found->second, sample.data);
      } else if (expected_ == 0) {
        strange(handle);
      } else if (held_.size() < most) {
        held_.push_back({handle, Bytes(sample.data.begin(), sample.data.end())});
      }
    }
  }
}

void NotificationInbox::strange(const Handle& handle) {
  if (known_strangers_.size() < most && known_strangers_.insert(handle).second) {
    strangers_.push_back(handle);
  }
}

void NotificationInbox::clear() {
  receivers_.clear();
  held_.clear();
  known_strangers_.clear();
  strangers_.clear();
}

}  // namespace millrace::cnc::ads
