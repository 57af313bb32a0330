#include "tools/commands/one_connection.hpp"

#include <fmt/format.h>

namespace millrace::tools::commands {

void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine) {
  if (machine.host.starts_with("127.") || machine.host == "localhost") {
    return;
  }
  fmt::print(stderr,
             "millrace: a TwinCAT router keeps one connection per host, the newest: a gateway on "
             "this host loses its connection to {} now and restores it as soon as it can\n",
             machine.name);
}

}  // namespace millrace::tools::commands
