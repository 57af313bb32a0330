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

/// The same for text in memory; `name` is the file's name in messages.
Settings parse_settings(const std::string& text, const std::string& name);

}  // namespace millrace::cnc::simulator
