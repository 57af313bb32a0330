#include "gateway/settings/settings.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>

#include <fmt/format.h>

#include "base/configuration/check.hpp"
#include "base/program/command_line.hpp"
#include "base/text/ascii.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/settings/readers.hpp"
#include "idl/gateway.pb.h"

namespace millrace::gateway::settings {

namespace {

using base::configuration::ConfigPath;
using base::configuration::Mistakes;
using base::program::UsageError;
using cnc::ads::NetId;

/// Turns the parts of a file into settings and notes what the options of its schema cannot detect;
/// `path` leads to the part.
class Reader {
 public:
  Reader(Mistakes& mistakes, std::filesystem::path folder)
      : mistakes_(mistakes), folder_(std::move(folder)) {}

  MachineSettings machine(const config::Machine& from, const ConfigPath& path) {
    MachineSettings to;
    to.name = from.name();
    const std::uint32_t usual = from.has_secure() ? cnc::ads::secure_port : to.controller.tcp_port;
    to.controller = {.host = from.host(),
                     .tcp_port = static_cast<std::uint16_t>(from.has_port() ? from.port() : usual),
                     .net_id = net_id(from.net_id(), path / "net_id"),
                     .source = net_id(from.source_net_id(), path / "source_net_id"),
                     .security = read_security(from, folder_, path, mistakes_)};
    to.channels.assign(from.channel().begin(), from.channel().end());
    const config::Poll& poll = from.poll();
    to.intervals.active = std::chrono::milliseconds(poll.active_ms());
    to.intervals.idle = std::chrono::milliseconds(poll.idle_ms());
    to.intervals.kernel_clears_request_state = from.kernel_clears_request_state();
    to.watch = subscription_mode_of(from.watch());
    to.symbol = symbol(from.symbol(), path / "symbol");
    to.data = read_data(from, path, mistakes_);
    to.programs = read_programs(from, path, mistakes_);
    to.variables = read_variables(from, path, mistakes_);
    to.variables.cycle = to.intervals.active;
    to.queues = read_queues(from, path, mistakes_);
    return to;
  }

  Policy policy(const config::Policy& from, const ConfigPath& path) {
    const auto rule = [&](bool is_there, const config::Rule& read, const std::string& name) {
      return is_there ? std::optional(this->rule(read, path / name)) : std::nullopt;
    };
    Policy to;
    to.unserved = rule(from.has_unserved(), from.unserved(), "unserved");
    to.lost = rule(from.has_lost(), from.lost(), "lost");
    if (from.has_refused()) {
      to.refused = refused(from.refused(), path / "refused");
    }
    if (from.has_deadline()) {
      mistakes_.expect(from.deadline().after_ms() > 0, path / "deadline",
                       "it has no after_ms; expected after_ms: 30000 or another time");
      to.deadline = values_of(from.deadline());
    }
    return to;
  }

 private:
  static SubscriptionMode subscription_mode_of(config::Machine::Watch watch) {
    switch (watch) {
      case config::Machine::AUTO:
        return SubscriptionMode::automatic;
      case config::Machine::NOTIFY:
        return SubscriptionMode::notify;
      case config::Machine::POLL:
        return SubscriptionMode::poll;
    }
    return SubscriptionMode::automatic;
  }

  std::string symbol(const std::string& text, const ConfigPath& path) {
    const bool both =
        text.find("{variable}") != std::string::npos && text.find("{channel}") != std::string::npos;
    std::string rest = text;
    for (const std::string_view known : {"{variable}", "{channel}"}) {
      for (auto at = rest.find(known); at != std::string::npos; at = rest.find(known)) {
        rest.erase(at, known.size());
      }
    }
    const bool right = mistakes_.expect(
        both && rest.find_first_of("{}") == std::string::npos, path,
        fmt::format("\"{}\"; expected {{channel}} and {{variable}} without other braces, as in "
                    "\"{}\"",
                    text, default_symbol));
    return right ? text : default_symbol;
  }

  NetId net_id(const std::string& text, const ConfigPath& path) {
    const auto id = NetId::parse(text);
    mistakes_.expect(id.has_value(), path,
                     fmt::format("\"{}\"; expected six numbers of 0 to 255 with dots, as in "
                                 "\"10.0.0.5.1.1\"",
                                 text));
    return id ? *id : NetId{};
  }

  Rule rule(const config::Rule& from, const ConfigPath& path) {
    mistakes_.expect(from.response_state() != 0, path,
                     "it has no response_state, or 0, which does not release the NC program; "
                     "expected response_state: 901 or another number");
    return values_of(from);
  }

  static Rule values_of(const config::Rule& from) {
    return {std::chrono::milliseconds(from.after_ms()), from.response_state()};
  }

  Rule refused(const config::Refused& from, const ConfigPath& path) {
    mistakes_.expect(
        !from.hold() || !from.has_response_state(), path,
        "it has both response_state and hold, and hold writes no state; expected one of them");
    return {std::chrono::milliseconds(0), from.hold() ? 0 : from.response_state()};
  }

  Mistakes& mistakes_;
  /// The folder of relative paths.
  std::filesystem::path folder_;
};

journal::Sync sync_of(config::Journal::Sync sync) {
  switch (sync) {
    case config::Journal::NEVER:
      return journal::Sync::never;
    case config::Journal::INTERVAL:
      return journal::Sync::interval;
    case config::Journal::ALWAYS:
      return journal::Sync::always;
  }
  return journal::Sync::interval;
}

Policies policies_of(const config::Gateway& config, Reader& reader, Mistakes& mistakes) {
  Policies policies;
  policies.everywhere = reader.policy(config.policy(), {{"policy"}});
  for (int i = 0; i < config.machine_size(); ++i) {
    policies.by_machine[config.machine(i).name()] =
        reader.policy(config.machine(i).policy(), {{"machine", i}, {"policy"}});
  }
  for (int i = 0; i < config.service_size(); ++i) {
    const ConfigPath path{{"service", i}};
    const std::string uuid = fabric::canonical_uuid(config.service(i).uuid());
    const Policy policy = reader.policy(config.service(i).policy(), path / "policy");
    mistakes.expect(policies.by_uuid.emplace(uuid, policy).second, path / "uuid",
                    fmt::format("\"{}\" occurs twice", uuid));
  }
  return policies;
}

std::uint16_t port_of(const std::string& text, const std::string& whole) {
  const std::uint16_t port = base::text::parse_number<std::uint16_t>(text).value_or(0);
  if (port == 0) {
    throw UsageError(fmt::format("--machine {}: port \"{}\"; expected 1 to 65535", whole, text));
  }
  return port;
}

/// A copied block: the calls of its channels would run twice.
void check_controllers(const std::vector<MachineSettings>& machines, Mistakes& mistakes) {
  for (std::size_t i = 0; i < machines.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const MachineSettings& earlier = machines[k];
      mistakes.expect(
          machines[i].address() != earlier.address() ||
              !fabric::have_common_channel(machines[i].channels, earlier.channels),
          {{"machine", static_cast<int>(i)}, {"host"}},
          fmt::format("\"{}\" is the controller of machine \"{}\" too; expected another host or "
                      "net_id, or other channels",
                      machines[i].controller.host, earlier.name));
    }
  }
}

/// Relative paths start at `folder`.
Settings settings_of(const config::Gateway& config, const std::filesystem::path& folder,
                     Mistakes& mistakes) {
  Reader reader(mistakes, folder);
  Settings settings;
  for (int i = 0; i < config.machine_size(); ++i) {
    settings.machines.push_back(reader.machine(config.machine(i), {{"machine", i}}));
  }
  check_controllers(settings.machines, mistakes);
  settings.policies = policies_of(config, reader, mistakes);
  mistakes.expect(
      !config.journal().none() || !config.journal().has_folder(), {{"journal"}, {"none"}},
      fmt::format("true beside folder: \"{}\"; expected one of both", config.journal().folder()));
  settings.no_journal = config.journal().none();
  settings.journal.folder = config.journal().folder();
  settings.journal.sync = sync_of(config.journal().sync());
  return settings;
}

}  // namespace

StateFolders StateFolders::of_environment() {
  const auto value = [](const char* name) {
    const char* const found = std::getenv(name);
    return std::string(found == nullptr ? "" : found);
  };
  return {value("STATE_DIRECTORY"), value("XDG_STATE_HOME"), value("HOME")};
}

std::filesystem::path default_journal_folder(const StateFolders& folders, std::string_view fabric,
                                             std::uint32_t domain) {
  if (!folders.state_directory.empty()) {
    return folders.state_directory.substr(0, folders.state_directory.find(':'));
  }
  std::string name = fmt::format("gateway-{}", domain);
  if (fabric != fabric::dds::ParticipantOptions{}.fabric) {
    name += fmt::format("-{}", fabric);
    std::ranges::replace(name, '/', '_');
  }
  // A relative path is to be ignored (XDG Base Directory Specification).
  if (folders.xdg_state_home.starts_with('/')) {
    return std::filesystem::path(folders.xdg_state_home) / "millrace" / name;
  }
  if (folders.home.empty()) {
    throw UsageError(
        "there is no folder for the journal: STATE_DIRECTORY, XDG_STATE_HOME and HOME are not set; "
        "name one with --journal, or --no-journal if calls need not survive this gateway");
  }
  return std::filesystem::path(folders.home) / ".local/state/millrace" / name;
}

std::string MachineSettings::to_string() const {
  return fmt::format("{} ({})", name, address());
}

std::string MachineSettings::address() const {
  return fmt::format("{}:{}, {}{}", controller.host, controller.tcp_port,
                     controller.net_id.to_string(), controller.security ? ", Secure ADS" : "");
}

bool MachineSettings::is_open_to_the_network() const {
  const std::string& host = controller.host;
  const bool this_host = host == "localhost" || host == "::1" || host.starts_with("127.");
  return !controller.security && !this_host;
}

std::string wrong_name(const std::string& name) {
  if (name.empty()) {
    return "a machine has no name; expected name: \"press1\"";
  }
  if (name.size() > fabric::longest_machine_name) {
    return fmt::format("the machine name \"{}\" has {} characters; expected at most {}", name,
                       name.size(), fabric::longest_machine_name);
  }
  if (!fabric::is_machine_name(name)) {
    return fmt::format("the machine name \"{}\"; expected letters, digits, '_' and '-'", name);
  }
  return {};
}

Settings read_settings(const std::filesystem::path& file) {
  const auto text = base::configuration::read_text(file);
  if (!text) {
    throw UsageError(text.error());
  }
  return parse_settings(*text, file);
}

Settings parse_settings(const std::string& text, const std::filesystem::path& file) {
  auto settings = base::configuration::load_text<config::Gateway>(
      text, file.string(), [&](const config::Gateway& config, Mistakes& mistakes) {
        return settings_of(config, file.parent_path(), mistakes);
      });
  if (!settings) {
    throw UsageError(settings.error());
  }
  return *std::move(settings);
}

MachineSettings parse_machine(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw UsageError(fmt::format(
        "--machine {}: expected NAME=HOST:PORT/NETID, as in press=10.0.0.5:48898/10.0.0.5.1.1",
        text));
  }
  MachineSettings machine;
  machine.name = text.substr(0, equals);
  if (const std::string wrong = wrong_name(machine.name); !wrong.empty()) {
    throw UsageError(fmt::format("--machine {}: {}", text, wrong));
  }
  const std::size_t slash = text.find('/', equals);
  std::string host =
      text.substr(equals + 1, slash == std::string::npos ? std::string::npos : slash - equals - 1);
  if (const std::size_t colon = host.rfind(':'); colon != std::string::npos) {
    machine.controller.tcp_port = port_of(host.substr(colon + 1), text);
    host.resize(colon);
  }
  if (host.empty()) {
    throw UsageError(fmt::format("--machine {}: the host is missing", text));
  }
  machine.controller.host = host;
  const std::string net_id = slash == std::string::npos ? host + ".1.1" : text.substr(slash + 1);
  const auto id = NetId::parse(net_id);
  if (!id) {
    throw UsageError(
        fmt::format("--machine {}: NetId \"{}\"; expected six numbers of 0 to 255 with dots, as in "
                    "10.0.0.5.1.1",
                    text, net_id));
  }
  machine.controller.net_id = *id;
  return machine;
}

void check_names(const std::vector<MachineSettings>& machines) {
  std::set<std::string> names;
  for (const MachineSettings& machine : machines) {
    if (!names.insert(machine.name).second) {
      throw UsageError(
          fmt::format("two machines are called \"{}\"; expected different names", machine.name));
    }
  }
}

}  // namespace millrace::gateway::settings
