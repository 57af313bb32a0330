// What the journal remembers: one entry before each step of a call that must be neither forgotten
// nor repeated after a crash.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "fabric/messages.hpp"
#include "gateway/picture.hpp"

namespace millrace::gateway::journal {

/// Call numbers of `epoch` below `reserved` may be in use. Written a block ahead, so that a number
/// is never given twice even if the newest entries are lost with the power.
struct Numbers {
  std::uint64_t epoch = 0;
  std::uint64_t reserved = 0;
  bool operator==(const Numbers&) const = default;
};

/// Before an attempt is published. The first one of a call opens it.
struct Dispatched {
  fabric::CallId call;
  fabric::ChannelKey key;
  PendingRequest request;
  fabric::Time seen{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  std::uint32_t attempt = 1;
  fabric::InstanceId instance;
  bool operator==(const Dispatched&) const = default;
};

/// Before an interim state is written to the channel, or once one that we have not written is found
/// beside the request.
struct Interim {
  fabric::CallId call;
  std::uint32_t state = 0;
  bool operator==(const Interim&) const = default;
};

/// A final answer.
struct Answer {
  fabric::InstanceId instance;
  std::uint32_t attempt = 1;
  std::string text;
  std::uint32_t state = 0;
  bool operator==(const Answer&) const = default;
};

/// Before anything of a final answer is written to the channel.
struct Answered {
  fabric::CallId call;
  Answer answer;
  bool operator==(const Answered&) const = default;
};

/// Before REQUEST_STATE is set to 0: from here on only RESPONSE_STATE releases the program.
struct Clearing {
  fabric::CallId call;
  bool operator==(const Clearing&) const = default;
};

/// The call is answered, or its program has withdrawn it: nothing is left to do.
struct Ended {
  fabric::CallId call;
  bool operator==(const Ended&) const = default;
};

using Entry = std::variant<Numbers, Dispatched, Interim, Answered, Clearing, Ended>;

}  // namespace millrace::gateway::journal
