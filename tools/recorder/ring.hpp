// The newest entries, limited in time and memory. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recorder {

class Ring {
 public:
  Ring(std::chrono::nanoseconds length, std::uint64_t size) : length_(length), size_(size) {}

  /// Adds an entry and drops what is too old or too much. Age is counted from the newest entry.
  void add(recording::Entry entry);
  /// Passes everything to `use`, oldest first, and is empty afterwards.
  void take(const std::function<void(const recording::Entry&)>& use);

  [[nodiscard]] std::size_t count() const { return entries_.size(); }
  /// Entries that were dropped before their time because the memory was full.
  [[nodiscard]] std::uint64_t crowded_out() const { return crowded_out_; }

 private:
  void drop_oldest();

  std::chrono::nanoseconds length_;
  std::uint64_t size_;
  std::deque<recording::Entry> entries_;
  std::uint64_t used_ = 0;
  std::uint64_t crowded_out_ = 0;
};

}  // namespace millrace::tools::recorder
