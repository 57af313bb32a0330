#include "gateway/settings/settings.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "base/program/command_line.hpp"
#include "fabric/messages.hpp"
#include "idl/gateway.pb.h"

namespace millrace::gateway::settings {

namespace {

using cnc::ads::NetId;
using Places = base::configuration::ConfigPlaces;
using base::program::UsageError;

constexpr std::size_t longest_name = 63;
constexpr std::uint32_t last_channel = 255;
constexpr std::uint32_t last_port = 65535;
constexpr std::uint32_t slowest_poll_ms = 1000;

bool name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

/// Turns the parts of a file into settings; `path` leads to the part, for its place in messages.
class Reader {
 public:
  Reader(const config::Gateway& config, const Places& places) : config_(config), places_(places) {}

  [[nodiscard]] MachineSettings machine(const config::Machine& from, int index) const {
    const Places::Step step{"machine", index};
    MachineSettings to;
    to.name = from.name();
    if (const std::string wrong = wrong_name(to.name); !wrong.empty()) {
      fail({step, {"name"}}, wrong);
    }
    if (from.host().empty()) {
      fail({step, {"host"}},
           fmt::format("machine {} has no host; expected host: \"10.0.0.5\"", to.name));
    }
    to.host = from.host();
    to.tcp_port =
        static_cast<std::uint16_t>(in_range(from.port(), 1, last_port, {step, {"port"}}, "port"));
    to.net_id = net_id(from.net_id(), {step, {"net_id"}}, "net_id");
    to.source = net_id(from.source_net_id(), {step, {"source_net_id"}}, "source_net_id");
    for (int i = 0; i < from.channel_size(); ++i) {
      to.channels.push_back(static_cast<std::uint16_t>(
          in_range(from.channel(i), 1, last_channel, {step, {"channel", i}}, "channel")));
    }
    to.pace = pace(from.poll(), step);
    return to;
  }

  [[nodiscard]] Policy policy(const config::Policy& from, std::vector<Places::Step> path) const {
    path.push_back({"policy"});
    Policy to;
    if (from.has_unserved()) {
      to.unserved = rule(from.unserved(), path, "unserved", true);
    }
    if (from.has_deadline()) {
      to.deadline = rule(from.deadline(), path, "deadline", false);
    }
    if (from.has_lost()) {
      to.lost = rule(from.lost(), path, "lost", true);
    }
    if (from.has_refused()) {
      to.refused = refused(from.refused(), path);
    }
    return to;
  }

  [[nodiscard]] std::uint32_t in_range(std::uint32_t value, std::uint32_t first, std::uint32_t last,
                                       const std::vector<Places::Step>& path,
                                       std::string_view what) const {
    if (value < first || value > last) {
      fail(path, fmt::format("{}: {}; expected {} to {}", what, value, first, last));
    }
    return value;
  }

  [[noreturn]] void fail(const std::vector<Places::Step>& path, const std::string& what) const {
    throw UsageError(fmt::format("{}: {}", places_.at(config_, path), what));
  }

 private:
  [[nodiscard]] NetId net_id(const std::string& text, const std::vector<Places::Step>& path,
                             std::string_view what) const {
    const auto id = NetId::parse(text);
    if (!id) {
      fail(path, fmt::format("{}: \"{}\"; expected six numbers of 0 to 255 with dots, as in "
                             "\"10.0.0.5.1.1\"",
                             what, text));
    }
    return *id;
  }

  [[nodiscard]] Rule rule(const config::Rule& from, std::vector<Places::Step> path,
                          const std::string& name, bool needs_state) const {
    path.push_back({name});
    if (needs_state && from.response_state() == 0) {
      fail(path, fmt::format("{} has no response_state, or 0, which releases no program; expected "
                             "response_state: 901 or another number",
                             name));
    }
    if (!needs_state && from.after_ms() == 0) {
      fail(path, fmt::format("{} has no after_ms; expected after_ms: 30000 or another time", name));
    }
    return {std::chrono::milliseconds(from.after_ms()), from.response_state()};
  }

  [[nodiscard]] Rule refused(const config::Refused& from, std::vector<Places::Step> path) const {
    path.push_back({"refused"});
    if (from.hold() && from.has_response_state()) {
      fail(path, "refused has a response_state and hold, which writes none; expected one of them");
    }
    if (from.response_state() == 0) {
      fail(path,
           "refused has response_state: 0, which releases no program; expected another number, or "
           "hold: true, which keeps the call for an operator");
    }
    return {std::chrono::milliseconds(0), from.hold() ? 0 : from.response_state()};
  }

  [[nodiscard]] Pace pace(const config::Poll& from, const Places::Step& step) const {
    const auto ms = [&](std::uint32_t value, const std::string& field) {
      return std::chrono::milliseconds(
          in_range(value, 1, slowest_poll_ms, {step, {"poll"}, {field}}, field));
    };
    Pace to;
    to.active = ms(from.active_ms(), "active_ms");
    to.idle = ms(from.idle_ms(), "idle_ms");
    return to;
  }

  const config::Gateway& config_;
  const Places& places_;
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

Policies policies_of(const config::Gateway& config, const Reader& reader) {
  Policies policies;
  policies.everywhere = reader.policy(config.policy(), {});
  for (int i = 0; i < config.machine_size(); ++i) {
    policies.by_machine[config.machine(i).name()] =
        reader.policy(config.machine(i).policy(), {{"machine", i}});
  }
  for (int i = 0; i < config.service_size(); ++i) {
    const std::string uuid = fabric::canonical_uuid(config.service(i).uuid());
    if (uuid.empty()) {
      reader.fail({{"service", i}},
                  "the service has no uuid; expected the UUID that programs call");
    }
    const Policy policy = reader.policy(config.service(i).policy(), {{"service", i}});
    if (!policies.by_uuid.emplace(uuid, policy).second) {
      reader.fail({{"service", i}, {"uuid"}},
                  fmt::format("the service {} is named twice; expected one policy for it", uuid));
    }
  }
  return policies;
}

std::uint16_t port_of(const std::string& text, const std::string& whole) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port == 0) {
    throw UsageError(
        fmt::format("--machine {}: port \"{}\"; expected 1 to {}", whole, text, last_port));
  }
  return port;
}

}  // namespace

std::string MachineSettings::to_string() const {
  return fmt::format("{} ({}:{}, {})", name, host, tcp_port, net_id.to_string());
}

std::string wrong_name(const std::string& name) {
  if (name.empty()) {
    return "a machine has no name; expected name: \"press1\"";
  }
  if (name.size() > longest_name) {
    return fmt::format("the machine name \"{}\" has {} characters; expected at most {}", name,
                       name.size(), longest_name);
  }
  if (!std::ranges::all_of(name, name_character)) {
    return fmt::format("the machine name \"{}\"; expected letters, digits, '_' and '-'", name);
  }
  return {};
}

Settings read_settings(const std::filesystem::path& file) {
  config::Gateway config;
  Places places;
  if (const auto read = base::configuration::read_config(file, config, places); !read) {
    throw UsageError(read.error());
  }
  const Reader reader(config, places);
  Settings settings;
  std::set<std::string> names;
  for (int i = 0; i < config.machine_size(); ++i) {
    settings.machines.push_back(reader.machine(config.machine(i), i));
    if (!names.insert(settings.machines.back().name).second) {
      reader.fail({{"machine", i}, {"name"}},
                  fmt::format("two machines are called \"{}\"; expected a name of its own for each",
                              settings.machines.back().name));
    }
  }
  settings.policies = policies_of(config, reader);
  settings.journal.folder = config.journal().folder();
  settings.journal.sync = sync_of(config.journal().sync());
  if (config.has_journal() && config.journal().folder().empty()) {
    reader.fail({{"journal"}}, "the journal has no folder; expected folder: \"/var/lib/millrace\"");
  }
  return settings;
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
    machine.tcp_port = port_of(host.substr(colon + 1), text);
    host.resize(colon);
  }
  if (host.empty()) {
    throw UsageError(fmt::format("--machine {}: it names no host", text));
  }
  machine.host = host;
  const std::string net_id = slash == std::string::npos ? host + ".1.1" : text.substr(slash + 1);
  const auto id = NetId::parse(net_id);
  if (!id) {
    throw UsageError(
        fmt::format("--machine {}: NetId \"{}\"; expected six numbers of 0 to 255 with dots, as in "
                    "10.0.0.5.1.1",
                    text, net_id));
  }
  machine.net_id = *id;
  return machine;
}

std::map<std::string, Pace> paces_of(const std::vector<MachineSettings>& machines) {
  std::map<std::string, Pace> paces;
  for (const MachineSettings& machine : machines) {
    paces[machine.name] = machine.pace;
  }
  return paces;
}

void check_names(const std::vector<MachineSettings>& machines) {
  std::set<std::string> names;
  for (const MachineSettings& machine : machines) {
    if (!names.insert(machine.name).second) {
      throw UsageError(fmt::format(
          "two machines are called \"{}\"; expected a name of its own for each", machine.name));
    }
  }
}

}  // namespace millrace::gateway::settings
