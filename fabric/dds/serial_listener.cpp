#include "fabric/dds/serial_listener.hpp"

#include "base/program/barrier.hpp"

namespace millrace::fabric::dds {

void SerialListener::run() noexcept {
  if (asked_.fetch_add(1) == 0) {
    take_turns();
  }
}

void SerialListener::take_turns() noexcept {
  unsigned seen = asked_.load();
  do {
    // Also after an exception: the next caller must find the serial free.
    base::program::contain("receiving samples from the fabric", work_);
  } while (!asked_.compare_exchange_strong(seen, 0));
}

void SerialListener::listen_for_data(dds_listener_t* listener) {
  dds_lset_data_available_arg(
      listener,
      [](dds_entity_t, void* self) noexcept { static_cast<SerialListener*>(self)->run(); }, this,
      true);
}

}  // namespace millrace::fabric::dds
