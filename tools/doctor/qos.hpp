// Whether a writer and a reader of one topic match: the QoS that DDS compares (OMG DDS 1.4, 2.2.3,
// "request versus offered"). Pure except for the conversion.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dds/dds.h>

namespace millrace::tools::doctor {

/// Durations in nanoseconds; the kinds in the order of the standard, a later one offering more.
struct EndpointQos {
  bool reliable = false;
  std::uint32_t durability = DDS_DURABILITY_VOLATILE;
  std::int64_t deadline = DDS_INFINITY;
  std::int64_t latency_budget = 0;
  bool exclusive = false;
  std::uint32_t liveliness = DDS_LIVELINESS_AUTOMATIC;
  std::int64_t lease = DDS_INFINITY;
  bool by_source_time = false;
};

/// Unset policies have the standard's default for this side.
EndpointQos qos_of(const dds_qos_t& qos, bool of_writer);

/// "reliability: best effort is offered, reliable is requested", … ; empty if they fit.
std::vector<std::string> misfits(const EndpointQos& offered, const EndpointQos& requested);

}  // namespace millrace::tools::doctor
