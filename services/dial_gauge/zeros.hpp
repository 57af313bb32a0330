// Stores the zero points of the gauges in a file, so that they survive a restart.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "services/dial_gauge/answering.hpp"

namespace millrace::services::dial_gauge {

/// The zero points of an earlier run; empty if the file does not exist. The error is the fault of
/// the file: the service must not answer with values from an unknown zero point.
tl::expected<Zeros, std::string> read_zeros(const std::filesystem::path& file);

/// Durable once it returns.
tl::expected<void, std::string> keep_zeros(const std::filesystem::path& file, const Zeros& zeros);

}  // namespace millrace::services::dial_gauge
