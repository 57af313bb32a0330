// The name of a caller on a fabric, from a small set.
//
// A service, an observer and Cyclone's tables keep something for each key of a call, some of it for
// ever (docs/dev/measurements/footprint.md). So the callers of a host share slots: each has one
// alone as long as it lives, and the next caller continues its numbers.
//
//   const Slot slot("call", participant.options());
//   const Order order{.key = {slot.machine(), 1}, …};
//   Caller caller(participant, executor, listener, slot);
#pragma once

#include <string>
#include <string_view>

#include "base/posix/system.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"

namespace millrace::tools::caller {

/// Free again when it is destroyed or its process ends.
class Slot {
 public:
  /// How many callers of one network namespace share slots in a fabric; more get unique names.
  static constexpr int most = 256;

  /// The lowest free slot of this host for the domain and fabric.
  Slot(std::string_view prefix, const fabric::dds::ParticipantOptions& options);

  /// "call.5f3a9c01": no other caller of the fabric has it now, and no gateway.
  [[nodiscard]] const std::string& machine() const { return machine_; }
  /// Its epoch is that of the calls; their numbers are higher than this one, and than those of all
  /// callers that had the slot before.
  [[nodiscard]] const fabric::CallId& before_first() const { return before_first_; }

 private:
  base::posix::Fd lock_;
  fabric::CallId before_first_;
  std::string machine_;
};

}  // namespace millrace::tools::caller
