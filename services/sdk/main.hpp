// The whole main of a service that needs no flags of its own.
//
//   int main(int argc, char** argv) {
//     return serve(argc, argv, {.uuid = "560aacbf-…", .name = "square_root"},
//                  [](const Call& call) -> Response { return {.text = root(call.text())}; });
//   }
#pragma once

#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

/// Serves until SIGTERM or SIGINT, with the command line of services/sdk/command_line.hpp.
int serve(int argc, char** argv, const ServiceOptions& options, const Handler& handler);
int serve(int argc, char** argv, const ServiceOptions& options, const AsyncHandler& handler);

}  // namespace millrace::services::sdk
