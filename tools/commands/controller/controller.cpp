#include "tools/commands/controller/controller.hpp"

namespace millrace::tools::commands::controller {

void add_controller(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "controller", "Find controllers, probe one, and add the route that it needs",
      "millrace controller find --interface eth0 --broadcast\n"
      "  millrace controller probe 192.168.10.5 --net-id 192.168.10.20.1.1\n"
      "  millrace controller add-route 192.168.10.5 --net-id 192.168.10.20.1.1 --user "
      "Administrator --self-signed /etc/millrace");
  command.require_subcommand(1);
  add_find(command, chosen);
  add_probe(command, chosen);
  add_route(command, chosen);
}

}  // namespace millrace::tools::commands::controller
