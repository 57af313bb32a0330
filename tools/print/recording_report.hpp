// The contents of a recording as text and as JSON: times of hops, a survey, missing samples.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "tools/mcap/summary.hpp"
#include "tools/recording/completeness.hpp"
#include "tools/recording/hops.hpp"

namespace millrace::tools::print {

// The times of hops per service, as a table and as JSON.

std::string hops_text(const recording::HopStatistics& hops);
boost::json::array hops_json(const recording::HopStatistics& hops);

// The times of hops as a metadata record of a file, which is part of its summary.

/// "560aacbf-… work" → "calls 17, p50 79.0 us, p99 1.20 ms, max 1.20 ms".
std::map<std::string, std::string> hops_metadata(const recording::HopStatistics& hops);

// Names in the metadata record of the recorder, "millrace.recorder".

inline constexpr const char* recorder_metadata = "millrace.recorder";
/// The calls that have ended in this file, and those of them without a response by a service.
inline constexpr const char* calls_ended = "calls_ended";
inline constexpr const char* calls_failed = "calls_failed";

// The contents of a recording, as `recording info` prints them; `size` is that of the file in
// bytes.

std::string text_of(const std::string& file, std::uint64_t size, const mcap::Survey& survey);
boost::json::object json_of(std::uint64_t size, const mcap::Survey& survey);

// The missing samples of a recording's calls, as text and JSON.

/// Each count and its name in metadata and JSON: "calls_complete", …, "missing_events".
std::array<std::pair<std::string_view, std::uint64_t>, 6> missing_counts(
    const recording::Missing& missing);

/// "4998 calls are complete; 2 calls are incomplete: at least 1 request, 0 replies and 2 events are
/// missing; 3 calls were not received"
std::string missing_text(const recording::Missing& missing);

}  // namespace millrace::tools::print
