// Enumeration values from another process that this one may not know. Pure.
//
//   if (!is_known(reply)) …                  // "is of an unknown kind or code"
#pragma once

#include <cstdint>
#include <limits>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// Any kind of a later version, or an invalid one.
inline constexpr auto unknown_kind =
    static_cast<ReplyKind>(std::numeric_limits<std::uint8_t>::max());

/// Whether this version knows the kind of the reply.
inline bool is_known(const Reply& reply) {
  return reply.kind <= ReplyKind::declined;
}

}  // namespace millrace::fabric
