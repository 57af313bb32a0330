#include "fabric/wire/key_limit.hpp"

#include "base/program/barrier.hpp"

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
    flooding_ = writer;
    return false;
  }
  keys[key] = ++admitted_;
  return true;
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
