#include "tools/doctor/qos.hpp"

#include <array>

#include <fmt/format.h>

namespace millrace::tools::doctor {

namespace {

template <std::size_t size>
std::string pick(const std::array<const char*, size>& names, std::uint32_t index) {
  return index < size ? names.at(index) : "unknown";
}

std::string durability(std::uint32_t kind) {
  return pick<4>({"volatile", "transient local", "transient", "persistent"}, kind);
}

std::string liveliness(std::uint32_t kind) {
  return pick<3>({"automatic", "manual by participant", "manual by topic"}, kind);
}

std::string duration(std::int64_t nanoseconds) {
  return nanoseconds == DDS_INFINITY ? "none"
                                     : fmt::format("{} ms", static_cast<double>(nanoseconds) / 1e6);
}

std::string misfit(const char* policy, const std::string& offered, const std::string& requested) {
  return fmt::format("{}: {} is offered, {} is requested", policy, offered, requested);
}

}  // namespace

EndpointQos qos_of(const dds_qos_t& qos, bool of_writer) {
  EndpointQos result;
  dds_reliability_kind_t reliability{};
  dds_duration_t ignored{};
  result.reliable = dds_qget_reliability(&qos, &reliability, &ignored)
                        ? reliability == DDS_RELIABILITY_RELIABLE
                        : of_writer;
  dds_durability_kind_t durability_kind{};
  if (dds_qget_durability(&qos, &durability_kind)) {
    result.durability = durability_kind;
  }
  dds_qget_deadline(&qos, &result.deadline);
  dds_qget_latency_budget(&qos, &result.latency_budget);
  dds_ownership_kind_t ownership{};
  result.exclusive = dds_qget_ownership(&qos, &ownership) && ownership == DDS_OWNERSHIP_EXCLUSIVE;
  dds_liveliness_kind_t liveliness_kind{};
  if (dds_qget_liveliness(&qos, &liveliness_kind, &result.lease)) {
    result.liveliness = liveliness_kind;
  }
  dds_destination_order_kind_t order{};
  result.by_source_time =
      dds_qget_destination_order(&qos, &order) && order == DDS_DESTINATIONORDER_BY_SOURCE_TIMESTAMP;
  return result;
}

std::vector<std::string> misfits(const EndpointQos& offered, const EndpointQos& requested) {
  std::vector<std::string> found;
  if (requested.reliable && !offered.reliable) {
    found.push_back(misfit("reliability", "best effort", "reliable"));
  }
  if (requested.durability > offered.durability) {
    found.push_back(
        misfit("durability", durability(offered.durability), durability(requested.durability)));
  }
  if (requested.deadline < offered.deadline) {
    found.push_back(misfit("deadline", duration(offered.deadline), duration(requested.deadline)));
  }
  if (requested.latency_budget < offered.latency_budget) {
    found.push_back(misfit("latency budget", duration(offered.latency_budget),
                           duration(requested.latency_budget)));
  }
  if (requested.exclusive != offered.exclusive) {
    found.push_back(misfit("ownership", offered.exclusive ? "exclusive" : "shared",
                           requested.exclusive ? "exclusive" : "shared"));
  }
  if (requested.liveliness > offered.liveliness) {
    found.push_back(
        misfit("liveliness", liveliness(offered.liveliness), liveliness(requested.liveliness)));
  }
  if (requested.lease < offered.lease) {
    found.push_back(misfit("liveliness lease", duration(offered.lease), duration(requested.lease)));
  }
  if (requested.by_source_time && !offered.by_source_time) {
    found.push_back(misfit("destination order", "by reception", "by source time"));
  }
  return found;
}

}  // namespace millrace::tools::doctor
