// Ownership of Cyclone's handles: entities and QoS sets.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <dds/dds.h>

namespace millrace::fabric::dds {

/// Returns `result` if it is not an error; else throws std::runtime_error("cannot WHAT: Cyclone's
/// reason"). For what is done at start-up.
dds_return_t check(dds_return_t result, std::string_view what);

/// Owns one DDS entity and, as Cyclone does, all its children. Deleting waits for listeners of it
/// that still run; afterwards none is called any more.
class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) : handle_(handle) {}
  ~Entity() { reset(); }
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }

  [[nodiscard]] dds_entity_t handle() const { return handle_; }

  void reset() {
    if (handle_ > 0) {
      dds_delete(std::exchange(handle_, 0));
    }
  }

 private:
  dds_entity_t handle_ = 0;
};

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

struct ListenerDeleter {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using Listener = std::unique_ptr<dds_listener_t, ListenerDeleter>;

/// Of an endpoint; none for the default partition.
std::vector<std::string> partitions_of(const dds_qos_t* qos);

/// The part of a GUID that names its participant, as Cyclone's log has it: "110a1f2:7c03f1d2:1".
std::string guid_prefix(const dds_guid_t& guid);

}  // namespace millrace::fabric::dds
