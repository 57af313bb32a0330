// The routes that clients have added to a virtual CNC, in a file:
//
//   192.168.10.20.1.1 AB:CD:…
#pragma once

#include <filesystem>
#include <memory>

#include "base/program/log.hpp"
#include "cnc/ads/routes.hpp"

namespace millrace::cnc::simulator {

/// Those of the file, which is written again with each that is added; an empty path = no file. The
/// log says which are added. Throws std::runtime_error if there is a file that cannot be read or
/// has other lines.
std::shared_ptr<ads::Routes> read_routes(const std::filesystem::path& file,
                                         const base::program::Log& log);

}  // namespace millrace::cnc::simulator
