// Enumeration values from another process that this one may not know. Pure.
//
//   if (!is_known(reply)) …                  // "is of an unknown kind or code"
#pragma once

#include <cstdint>
#include <limits>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// Stands for any of a later version, or that makes no sense.
inline constexpr auto unknown_kind =
    static_cast<ReplyKind>(std::numeric_limits<std::uint8_t>::max());

/// Whether this version knows what kind of reply it is.
inline bool is_known(const Reply& reply) {
  return reply.kind <= ReplyKind::declined;
}

}  // namespace millrace::fabric
