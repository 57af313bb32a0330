// The zero points of the gauges in a file, so that a restart does not lose them.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "services/dial_gauge/answering.hpp"

namespace millrace::services::dial_gauge {

/// The zero points of an earlier run; none if the file is not there. The error says what is wrong
/// with it: values must not be answered from a zero point nobody knows.
tl::expected<Zeros, std::string> read_zeros(const std::filesystem::path& file);

/// Durable once it returns.
tl::expected<void, std::string> keep_zeros(const std::filesystem::path& file, const Zeros& zeros);

}  // namespace millrace::services::dial_gauge
