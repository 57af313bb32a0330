// Whether a writer has readers for what it has to say.
//
//   ReaderCount readers([] { … });        // called in Cyclone's thread, when readers come or go
//   readers.listen(listener);             // to be given to the writer when it is created
//   if (readers.present()) writer.write(value);
//
// To ask Cyclone each time takes two of its locks.
#pragma once

#include <atomic>
#include <functional>

#include "base/program/barrier.hpp"
#include "fabric/dds/entity.hpp"

namespace millrace::fabric::dds {

/// Must outlive the writer.
class ReaderCount {
 public:
  explicit ReaderCount(std::function<void()> changed = [] {}) : changed_(std::move(changed)) {}
  ReaderCount(const ReaderCount&) = delete;
  ReaderCount& operator=(const ReaderCount&) = delete;

  void listen(dds_listener_t* listener) {
    dds_lset_publication_matched_arg(
        listener,
        [](dds_entity_t, dds_publication_matched_status_t status, void* self) noexcept {
          static_cast<ReaderCount*>(self)->count(status.current_count);
        },
        this, true);
  }

  /// From any thread.
  [[nodiscard]] bool present() const { return present_; }

 private:
  void count(std::uint32_t readers) noexcept {
    present_ = readers > 0;
    base::program::contain("counting readers", changed_);
  }

  std::function<void()> changed_;
  std::atomic<bool> present_ = false;
};

}  // namespace millrace::fabric::dds
