// What the plant is at the moment, in numbers: its channels, links, message queues, sampled values,
// and what programs say of themselves. Pure.
//
//   put_links(families, plant.live());
//
// The first so many of each are told; what belongs to a machine beyond is counted as "other" or
// left out.
#pragma once

#include <cstddef>

#include "tools/web/metrics/families.hpp"
#include "tools/web/plant/plant_model.hpp"

namespace millrace::tools::web::metrics {

inline constexpr std::size_t most_machines = 200;
inline constexpr std::size_t most_channels = 2'000;
inline constexpr std::size_t most_alarms = 200;
inline constexpr std::size_t most_queues = 1'000;

/// The state of each channel and what its gateway counted; by machine the calls that are under way
/// and that wait, and whether the journal takes any.
void put_channels(Families& families, const bus::FabricModel& live);
/// Of each machine: whether it is connected, how it is looked at, and its gateways.
void put_links(Families& families, const bus::FabricModel& live);
/// What programs say of themselves.
void put_alarms(Families& families, const bus::FabricModel& live);
/// How many sampled values of each machine are good, stale, refused.
void put_data(Families& families, const plant::DataStore& data);
/// What stands in each message queue, and what of it was read and answered.
void put_queues(Families& families, const plant::DataStore& data);

}  // namespace millrace::tools::web::metrics
