#include "fabric/wire/key_limit.hpp"

#include <utility>

#include "base/program/barrier.hpp"
#include "fabric/wire/endpoint.hpp"

namespace millrace::fabric::wire {

void KeyLimit::watch(const dds::Entity& topic) {
  dds_topic_filter filter{};
  filter.mode = DDS_TOPIC_FILTER_SAMPLEINFO_ARG;
  filter.f.sampleinfo_arg = [](const dds_sample_info_t* info, void* self) -> bool {
    bool admitted = true;
    base::program::contain("counting the keys of a writer", [&] {
      admitted =
          static_cast<KeyLimit*>(self)->admits(info->publication_handle, info->instance_handle);
    });
    return admitted;
  };
  filter.arg = this;
  dds::check(dds_set_topic_filter_extended(topic.handle(), &filter), "limit keys");
}

bool KeyLimit::admits(dds_instance_handle_t writer, dds_instance_handle_t key) {
  const std::lock_guard guard(lock_);
  if (keys_.use(writer) == nullptr) {
    keys_.put(writer);
  }
  auto& keys = keys_.newest();
  if (keys.size() >= most_ && !keys.contains(key)) {
    if (flooding_.size() < most_flooding) {
      flooding_.insert(writer);
    }
    return false;
  }
  keys[key] = ++admitted_;
  return true;
}

std::optional<dds_instance_handle_t> KeyLimit::take_flooding() {
  const std::lock_guard guard(lock_);
  if (flooding_.empty()) {
    return std::nullopt;
  }
  return flooding_.extract(flooding_.begin()).value();
}

void KeyLimit::listen(dds_listener_t* listener) {
  dds_lset_subscription_matched_arg(
      listener,
      [](dds_entity_t reader, dds_subscription_matched_status_t status, void* self) noexcept {
        base::program::contain("naming a writer", [&] {
          if (status.current_count_change > 0) {
            const dds_instance_handle_t writer = status.last_publication_handle;
            std::string name = program_of(reader, writer);
            auto& limit = *static_cast<KeyLimit*>(self);
            const std::lock_guard guard(limit.lock_);
            limit.names_.put(writer, std::move(name));
          }
        });
      },
      this, true);
}

std::string KeyLimit::name_of(dds_instance_handle_t writer) const {
  const std::lock_guard guard(lock_);
  const std::string* const name = names_.find(writer);
  return name != nullptr ? *name : std::string();
}

void KeyLimit::forget(dds_instance_handle_t key, std::uint64_t before) {
  const std::lock_guard guard(lock_);
  for (auto& [writer, keys] : keys_) {
    if (const auto known = keys.find(key); known != keys.end() && known->second <= before) {
      keys.erase(known);
    }
  }
}

}  // namespace millrace::fabric::wire
