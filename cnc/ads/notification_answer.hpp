// Answers the requests that add and delete device notifications, single ones and sums.
#pragma once

#include <optional>

#include "cnc/ads/subscriptions.hpp"

namespace millrace::cnc::ads {

namespace sum {
/// Index groups of ReadWrites; the index offset is the number of items. In: 40 bytes for each
/// notification. Out: result and handle of each.
inline constexpr std::uint32_t add_notifications = 0xF085;
/// In: handles. Out: all results.
inline constexpr std::uint32_t delete_notifications = 0xF086;
}  // namespace sum

/// The payload of the response; nullopt for any other request.
std::optional<Bytes> answer_notification(Subscriptions& subscriptions, const Packet& packet,
                                         Moment now);

}  // namespace millrace::cnc::ads
