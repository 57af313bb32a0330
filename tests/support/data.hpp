// The files of tests/data.
#pragma once

#include <filesystem>
#include <string_view>

namespace millrace::tests {

/// The path of "nc/square_root.nc", or of "config".
std::filesystem::path test_data(std::string_view name);

}  // namespace millrace::tests
