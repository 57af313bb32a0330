// The numbers of a gateway's calls. The journal reserves them in blocks, so that none is used
// twice, even if its newest entries are lost in a power failure. Pure.
//
//   CallNumbers numbers(state.numbers());
//   if (const auto entry = numbers.reserve()) append(*entry);      // then numbers.on_recorded()
//   if (numbers.available()) call.id = numbers.take();
#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <utility>

#include "fabric/messages.hpp"
#include "gateway/journal_entry.hpp"

namespace millrace::gateway::core {

class CallNumbers {
 public:
  /// Continues after the numbers in the journal, which must have an epoch.
  explicit CallNumbers(const NumbersEntry& known)
      : epoch_(known.epoch),
        last_(known.reserved),
        recorded_(known.reserved),
        reserved_(known.reserved) {
    assert(epoch_ != 0);
  }

  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  /// False if the journal has not confirmed the next one: a request has to wait for that.
  [[nodiscard]] bool available() {
    awaited_ = awaited_ || last_ == recorded_;
    return last_ != recorded_;
  }
  fabric::CallId take() {
    assert(last_ < recorded_);
    return {epoch_, ++last_};
  }
  /// The next block is reserved when half of the last one is used, so that no call waits for the
  /// disk.
  std::optional<NumbersEntry> reserve() {
    if (reserved_ != recorded_ || reserved_ - last_ >= block / 2) {
      return std::nullopt;
    }
    reserved_ += block;
    return NumbersEntry{epoch_, reserved_};
  }
  /// The journal has stored the reservation. True if a request waits for it.
  bool on_recorded() {
    recorded_ = reserved_;
    return std::exchange(awaited_, false);
  }

 private:
  /// A restart continues after the block (our choice).
  static constexpr std::uint64_t block = 1000;

  std::uint64_t epoch_;
  std::uint64_t last_;
  std::uint64_t recorded_;
  std::uint64_t reserved_;
  bool awaited_ = false;
};

}  // namespace millrace::gateway::core
