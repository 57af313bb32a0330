// Reads the configuration of a virtual CNC: protobuf text format with the schema idl/cnc.proto.
//
//   Machine machine(read_settings("cnc.textproto"), …);
#pragma once

#include <filesystem>
#include <string>

#include "cnc/simulator/settings.hpp"

namespace millrace::cnc::simulator {

/// @throws base::program::UsageError with file, line and column of every mistake
Settings read_settings(const std::filesystem::path& file);

/// The same for text in memory. `file` stands for its file in messages, and relative paths start
/// beside it.
Settings parse_settings(const std::string& text, const std::filesystem::path& file);

}  // namespace millrace::cnc::simulator
