// Whether anybody reads what a writer has to say.
//
//   Audience audience([] { … });            // called in Cyclone's thread, when readers come or go
//   audience.listen(listener);              // to be given to the writer when it is created
//   if (audience.present()) writer.write(value);
//
// To ask Cyclone each time takes two of its locks.
#pragma once

#include <atomic>
#include <functional>

#include "fabric/entity.hpp"

namespace millrace::fabric {

/// Must outlive the writer.
class Audience {
 public:
  explicit Audience(std::function<void()> changed = [] {}) : changed_(std::move(changed)) {}
  Audience(const Audience&) = delete;
  Audience& operator=(const Audience&) = delete;

  void listen(dds_listener_t* listener) {
    dds_lset_publication_matched_arg(
        listener,
        [](dds_entity_t, dds_publication_matched_status_t status, void* self) {
          static_cast<Audience*>(self)->count(status.current_count);
        },
        this, true);
  }

  /// From any thread.
  [[nodiscard]] bool present() const { return present_; }

 private:
  void count(std::uint32_t readers) {
    present_ = readers > 0;
    changed_();
  }

  std::function<void()> changed_;
  std::atomic<bool> present_ = false;
};

}  // namespace millrace::fabric
