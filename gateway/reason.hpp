// Why a channel does not go on, for programs and for people.
#pragma once

#include <string>

#include "fabric/messages.hpp"

namespace millrace::gateway {

struct Reason {
  fabric::Cause cause = fabric::Cause::none;
  std::string text{};
  bool operator==(const Reason&) const = default;
};

}  // namespace millrace::gateway
