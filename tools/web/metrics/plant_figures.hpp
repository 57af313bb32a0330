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
#include "tools/web/plant/plant.hpp"

namespace millrace::tools::web::metrics {

inline constexpr std::size_t most_machines = 200;
inline constexpr std::size_t most_channels = 2'000;
inline constexpr std::size_t most_notices = 200;
inline constexpr std::size_t most_queues = 1'000;

void put_channels(Families& families, const bus::Live& live);
void put_links(Families& families, const bus::Live& live);
void put_notices(Families& families, const bus::Live& live);
void put_data(Families& families, const plant::DataBook& data);
void put_queues(Families& families, const plant::DataBook& data);

}  // namespace millrace::tools::web::metrics
