// millrace health: whether the programs of a host do their work, in one exit code.
#include <algorithm>
#include <set>

#include <boost/json/object.hpp>
#include <fmt/format.h>

#include "base/posix/host.hpp"
#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/json.hpp"
#include "tools/print/notice_text.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct HealthOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string host = base::posix::host_name();
  bool all = false;
};

// What is wrong with --all, the worst first.
constexpr int exit_link_down = 3;
constexpr int exit_held = 4;
constexpr int exit_unserved = 5;
constexpr int exit_trouble = 6;

/// Whoever has a loop that may hang: the gateways of a host, in the words of an instance, and its
/// services.
struct Programs {
  std::vector<fabric::InstanceIdentity> gateways;
  std::vector<fabric::InstanceIdentity> instances;
  /// What they say of themselves, and others of the host that have no calls, such as a recorder.
  /// Whose loop hangs says nothing any more.
  std::vector<fabric::Notice> notices;
};

Programs programs_on(const bus::Live& live, const std::string& host) {
  Programs found;
  for (const auto& [id, status] : live.gateways()) {
    if (status.host == host) {
      found.gateways.push_back(
          {.id = id,
           .name = fmt::format("gateway {:012x} (pid {})", status.epoch, status.pid),
           .host = status.host});
    }
  }
  for (const bus::LiveInstance* instance : live.instances_of("")) {
    if (instance->identity.host == host) {
      found.instances.push_back(instance->identity);
    }
  }
  for (const auto& [key, notice] : live.notices()) {
    if (notice.host == host) {
      found.notices.push_back(notice);
    }
  }
  return found;
}

/// Prints, or adds to `out`, what the gateways tell of their machines. A link that is down is no
/// fault of the gateway.
void show_machines(const HealthOptions& options, const bus::Live& live, const Programs& programs,
                   boost::json::array& out) {
  for (const auto& [key, status] : live.machines()) {
    if (std::ranges::find(programs.gateways, key.second, &fabric::InstanceIdentity::id) ==
        programs.gateways.end()) {
      continue;
    }
    if (options.json) {
      boost::json::object object;
      print::put_machine(object, status);
      out.push_back(std::move(object));
    } else {
      fmt::print("gateway of {} on {}: {}\n", base::text::safe(status.machine),
                 base::text::safe(options.host),
                 status.connected ? "link up" : "link down: " + base::text::safe(status.reason));
    }
  }
}

/// --all: says each thing that is wrong, and remembers the exit code of the worst.
class Wrongs {
 public:
  void note(int code, const std::string& what) {
    worst_ = worst_ == base::program::exit_done ? code : std::min(worst_, code);
    say(what);
  }
  void say(const std::string& what) const {
    fmt::print(stderr, "millrace: {}\n", base::text::safe(what));
  }
  [[nodiscard]] int exit_code() const { return worst_; }

 private:
  int worst_ = base::program::exit_done;
};

/// The links of these gateways and the channels of their machines.
void look_at_machines(const bus::Live& live, const Programs& programs, Wrongs& wrongs) {
  std::set<std::string> machines;
  for (const auto& [key, status] : live.machines()) {
    if (std::ranges::find(programs.gateways, key.second, &fabric::InstanceIdentity::id) ==
        programs.gateways.end()) {
      continue;
    }
    machines.insert(status.machine);
    // A gateway that stands by has no link, and needs none.
    const bool has_link = std::ranges::any_of(live.machines(), [&](const auto& one) {
      return one.second.machine == status.machine && one.second.connected;
    });
    if (!has_link) {
      wrongs.note(exit_link_down, fmt::format("{}: link down: {}", status.machine, status.reason));
    }
  }
  for (const auto& [key, status] : live.channels()) {
    if (!machines.contains(key.machine)) {
      continue;
    }
    if (status.state == fabric::ChannelState::held) {
      wrongs.note(exit_held, fmt::format("{}: a call is held: {}", key.to_string(), status.reason));
    } else if (status.state == fabric::ChannelState::unserved) {
      wrongs.note(exit_unserved, fmt::format("{}: nobody serves {}: {}", key.to_string(),
                                             status.uuid, status.reason));
    }
  }
}

/// What the programs of the host say of themselves. A warning is told, and is no failure.
void look_at_notices(const std::vector<fabric::Notice>& notices, Wrongs& wrongs) {
  for (const fabric::Notice& notice : notices) {
    const std::string what =
        print::what_is_said(notice) + (notice.advice.empty() ? "" : " -> " + notice.advice);
    if (notice.level == fabric::NoticeLevel::warning) {
      wrongs.say(what);
    } else if (notice.level != fabric::NoticeLevel::fine) {
      wrongs.note(exit_trouble, what);
    }
  }
}

/// Takes the answers of the gateways, which are the first, out of all.
boost::json::array take_gateways(boost::json::array& answers, std::size_t gateways) {
  boost::json::array taken;
  for (std::size_t i = 0; i < gateways; ++i) {
    boost::json::object& answer = answers.at(i).as_object();
    answer["gateway"] = answer["instance"];
    answer.erase("instance");
    taken.push_back(std::move(answer));
  }
  answers.erase(answers.begin(), answers.begin() + gateways);
  return taken;
}

int check(const HealthOptions& options) {
  const bus::Live live = bus::take_snapshot(options.fabric.options());
  const Programs programs = programs_on(live, options.host);
  boost::json::array machines;
  boost::json::array answers;
  show_machines(options, live, programs, machines);
  std::vector<fabric::InstanceIdentity> asked = programs.gateways;
  asked.insert(asked.end(), programs.instances.begin(), programs.instances.end());
  const bool nobody = asked.empty() && programs.notices.empty();
  const bool healthy = !nobody && tell_each(options, fabric::CommandKind::ping, asked, answers);
  if (options.json) {
    boost::json::array gateways = take_gateways(answers, programs.gateways.size());
    boost::json::array notices;
    for (const fabric::Notice& notice : programs.notices) {
      notices.push_back(print::json_of(notice));
    }
    print::print_json(boost::json::object{{"healthy", healthy},
                                          {"machines", std::move(machines)},
                                          {"gateways", std::move(gateways)},
                                          {"instances", std::move(answers)},
                                          {"notices", std::move(notices)}});
  }
  if (nobody) {
    fmt::print(stderr,
               "millrace: no gateway, no service and no recorder of host '{}' is on fabric '{}', "
               "domain {}; "
               "'millrace services' and 'millrace machines' show who is\n",
               options.host, options.fabric.options().fabric, options.fabric.options().domain);
  }
  if (!healthy) {
    return base::program::exit_failed;
  }
  if (!options.all) {
    return base::program::exit_done;
  }
  Wrongs wrongs;
  look_at_machines(live, programs, wrongs);
  look_at_notices(programs.notices, wrongs);
  return wrongs.exit_code();
}

}  // namespace

void add_health(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "health",
      "Whether the gateway and the services of a host are there and answer, as exit code 0 or 1",
      "millrace health --host press-pc");
  auto options = std::make_shared<HealthOptions>(command);
  command.add_option("--host", options->host,
                     "The host, as it calls itself; this one unless given");
  command.add_flag(
      "--all", options->all,
      "Also whether their controllers and channels are well, and what programs say of themselves: "
      "exit code 3 for a link that is down, 4 for a held call, 5 for one that nobody serves, 6 for "
      "a program that says it has a problem");
  command.callback([options, &chosen] { chosen.run = [options] { return check(*options); }; });
}

}  // namespace millrace::tools::commands::operate
