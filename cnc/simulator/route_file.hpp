// The routes that clients have added to a virtual CNC, in a file:
//
//   192.168.10.20.1.1 AB:CD:…
#pragma once

#include <filesystem>
#include <memory>

#include "base/program/log.hpp"
#include "cnc/ads/routes.hpp"

namespace millrace::cnc::simulator {

/// Reads the routes of the file; each added route is logged, and the file is rewritten. An empty
/// path = no file. A missing file counts as empty. Throws std::runtime_error for a malformed line
/// and for a file that cannot be read.
std::shared_ptr<ads::Routes> read_routes(const std::filesystem::path& file,
                                         const base::program::Log& log);

}  // namespace millrace::cnc::simulator
