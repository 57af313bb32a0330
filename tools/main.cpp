// millrace: the operator's command.
#include "base/program/command_line.hpp"
#include "tools/commands/completion.hpp"
#include "tools/commands/controller/controller.hpp"
#include "tools/commands/data/data.hpp"
#include "tools/commands/doctor/doctor.hpp"
#include "tools/commands/lint/lint.hpp"
#include "tools/commands/log/log.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/commands/record/record.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/trust/trust.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/commands/watch/watch.hpp"
#include "tools/commands/web/web.hpp"

int main(int argc, char** argv) {
  using namespace millrace::tools;
  CLI::App app{"millrace: look at, operate, record and replay the service calls of a fabric"};
  app.require_subcommand(1);
  commands::Chosen chosen;
  commands::doctor::add_doctor(app, chosen);
  commands::look::add_services(app, chosen);
  commands::look::add_info(app, chosen);
  commands::look::add_stats(app, chosen);
  commands::look::add_channels(app, chosen);
  commands::look::add_machines(app, chosen);
  commands::data::add_data(app, chosen);
  commands::data::add_programs(app, chosen);
  commands::data::add_queues(app, chosen);
  commands::operate::add_call(app, chosen);
  commands::operate::add_ping(app, chosen);
  commands::operate::add_health(app, chosen);
  commands::operate::add_drain(app, chosen);
  commands::operate::add_answer(app, chosen);
  commands::operate::add_retry(app, chosen);
  commands::watch::add_watch(app, chosen);
  commands::web::add_web(app, chosen);
  commands::vars::add_vars(app, chosen);
  commands::controller::add_controller(app, chosen);
  commands::record::add_record(app, chosen);
  commands::replay::add_replay(app, chosen);
  commands::log::add_log(app, chosen);
  commands::lint::add_lint(app, chosen);
  commands::trust::add_trust(app, chosen);
  commands::add_completion(app, chosen);
  return millrace::base::program::run(app, argc, argv, [&] { return chosen.run(); });
}
