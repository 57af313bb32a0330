#include "tools/bus/other_fabrics.hpp"

#include <cstdint>
#include <string_view>

#include <dds/dds.h>

#include "fabric/dds/entity.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::tools::bus {

namespace {

constexpr std::string_view millrace_topics = "millrace/";
constexpr std::size_t most_fabrics = 16;

/// "millrace" of "millrace/560a…"
void add_fabrics(const dds_qos_t* qos, std::set<std::string>& fabrics) {
  std::uint32_t count = 0;
  char** partitions = nullptr;
  if (!dds_qget_partition(qos, &count, &partitions)) {
    return;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string_view partition = partitions[i];
    const std::string name(partition.substr(0, partition.find('/')));
    if (fabrics.size() < most_fabrics && fabric::dds::is_fabric_name(name)) {
      fabrics.insert(name);
    }
    dds_free(partitions[i]);
  }
  dds_free(static_cast<void*>(partitions));
}

}  // namespace

std::set<std::string> other_fabrics(const fabric::dds::Participant& participant) {
  const fabric::dds::Entity writers(fabric::dds::check(
      dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
      "read DCPSPublication"));
  std::set<std::string> fabrics;
  const auto use = [&](const dds_builtintopic_endpoint_t& writer, const dds_sample_info_t& info) {
    if (info.valid_data && std::string_view(writer.topic_name).starts_with(millrace_topics)) {
      add_fabrics(writer.qos, fabrics);
    }
  };
  while (fabric::wire::take_lent<dds_builtintopic_endpoint_t>(writers.handle(), use) > 0) {
  }
  fabrics.erase(participant.options().fabric);
  return fabrics;
}

}  // namespace millrace::tools::bus
