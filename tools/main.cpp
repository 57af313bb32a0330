// millrace: the operator's command.
#include "base/program/command_line.hpp"
#include "fabric/dds/configuration.hpp"
#include "tools/commands/calls/calls.hpp"
#include "tools/commands/controller/controller.hpp"
#include "tools/commands/data/data.hpp"
#include "tools/commands/doctor/doctor.hpp"
#include "tools/commands/lint/lint.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/commands/record/record.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/status/status.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/commands/trust/trust.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/commands/web/web.hpp"

namespace {

using namespace millrace::tools::commands;

struct Group {
  const char* name;
  std::vector<void (*)(CLI::App&, Chosen&)> commands;
};

const std::vector<Group> groups{
    {"Look",
     {&status::add_status, &look::add_machines, &look::add_channels, &look::add_services,
      &calls::add_calls, &data::add_data, &data::add_programs, &data::add_queues, &vars::add_vars}},
    {"Act", {&operate::add_call, &operate::add_answer, &operate::add_retry, &operate::add_drain}},
    {"Check", {&doctor::add_doctor, &lint::add_lint}},
    {"Record", {&record::add_record, &replay::add_replay, &recordings::add_recording}},
    {"Set up", {&web::add_web, &trust::add_trust, &controller::add_controller, &add_completion}}};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"millrace: look at, operate, record and replay the service calls of a fabric"};
  app.footer(
      "Examples:\n"
      "  millrace                          what needs attention, as 'millrace status'\n"
      "  millrace services -i              each instance of each service\n"
      "  millrace answer press/1 OK --state 1\n"
      "  millrace record -o run.mcap\n"
      "  millrace COMMAND --help           examples and options of a command");
  app.require_subcommand(1);
  Chosen chosen;
  for (const Group& group : groups) {
    for (const auto add : group.commands) {
      add(app, chosen);
      app.get_subcommands({}).back()->group(group.name);
    }
  }
  std::vector<std::string> words = word_order({argv + 1, argv + argc});
  if (words.front() != "web" && words.front() != "record") {
    millrace::fabric::dds::hide_rejections();
  }
  std::vector<char*> ordered{argv[0]};
  for (std::string& word : words) {
    ordered.push_back(word.data());
  }
  return millrace::base::program::run(app, static_cast<int>(ordered.size()), ordered.data(),
                                      [&] { return chosen.run(); });
}
