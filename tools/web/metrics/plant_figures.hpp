// The present state of the plant in numbers: channels, links, message queues, sampled values and
// alarms. Pure.
//
//   put_links(families, plant.live());
//
// The number of each is limited. What a machine has beyond the limit is counted as "other" or left
// out.
#pragma once

#include <cstddef>

#include "tools/web/metrics/families.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::metrics {

inline constexpr std::size_t most_machines = 200;
inline constexpr std::size_t most_channels = 2'000;
inline constexpr std::size_t most_alarms = 200;
inline constexpr std::size_t most_queues = 1'000;

/// The state and the counters of each channel; by machine the calls that run and that wait, and
/// whether the journal accepts calls.
void put_channels(Families& families, const bus::FabricModel& live);
/// Of each machine: whether it is connected, how it is read, and its gateways.
void put_links(Families& families, const bus::FabricModel& live);
/// The alarms of all processes.
void put_alarms(Families& families, const bus::FabricModel& live);
/// How many sampled values of each machine are good, stale, refused.
void put_data(Families& families, const plant::DataStore& data);
/// The fill level of each message queue, and how many messages were read and answered.
void put_queues(Families& families, const plant::DataStore& data);

}  // namespace millrace::tools::web::metrics
