// init, issue, renew, renew-authorities, revoke: what writes the folder of a plant.
#include "tools/commands/trust/make.hpp"

#include <fstream>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/commands/trust/plants.hpp"

namespace millrace::tools::commands::trust {

namespace {

using base::program::UsageError;
using fabric::trust::Member;

struct InitOptions : PlantOptions {
  std::string fabric = "millrace";
  std::string name;
  int days = 3650;
};

struct IssueOptions : PlantOptions {
  Member member;
  std::vector<std::string> roles;
  tools::trust::IssueOptions how;
  bool renew = false;
};

struct NamedOptions : PlantOptions {
  std::string name;
  int days = tools::trust::IssueOptions{}.days;
};

void say_where(const tools::trust::Plant& plant, const tools::trust::Entry& entry, int days) {
  fmt::print("{}: valid until {:%F}; copy it to its host, and nothing else of {}\n",
             plant.folder_of(entry.member.name).string(), entry.until,
             plant.folder_of("").parent_path().string());
  if (entry.until < entry.from + std::chrono::days(days)) {
    fmt::print("that is when the authorities end: {} days would be longer\n", days);
  }
}

int init(const InitOptions& options) {
  if (!fabric::dds::is_fabric_name(options.fabric) ||
      options.fabric.find_first_of("[]\\") != std::string::npos) {
    throw UsageError(
        fmt::format("--fabric {}: expected some text without '*', '?', '[', ']', '\\', '/' and ','",
                    options.fabric));
  }
  const std::filesystem::path folder(options.folder);
  // "plant/" is "plant", and "." is where we are.
  const std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  const std::filesystem::path last =
      whole.has_filename() ? whole.filename() : whole.parent_path().filename();
  const std::string name = options.name.empty() ? last.string() : options.name;
  must(tools::trust::Plant::create(folder, name, options.fabric, options.days,
                                   passphrase_of(options), now()));
  fmt::print(
      "{0}: the authorities of {1}, for the fabric {2}. Keep {0}/authorities where only you can "
      "read it: who has it can be anything\n"
      "next: millrace trust issue {0} gateway-1 --role gateway --machine NAME\n",
      options.folder, name, options.fabric);
  return base::program::exit_done;
}

bool is_another(const Member& before, const Member& after) {
  return before.roles != after.roles || before.uuids != after.uuids ||
         before.machines != after.machines;
}

int issue(IssueOptions options) {
  for (const std::string& text : options.roles) {
    const auto role = fabric::trust::role_named(text);
    if (!role) {
      throw UsageError(
          fmt::format("--role {}: expected gateway, service, operator, observer or tester", text));
    }
    options.member.roles.insert(*role);
  }
  tools::trust::Plant plant = open(options);
  const auto before = plant.entry(options.member.name);
  const std::string passphrase = passphrase_of(options);
  const bool again = options.renew && before;
  const auto entry = must(again ? plant.reissue(options.member, options.how, passphrase, now())
                                : plant.issue(options.member, options.how, passphrase, now()));
  say_where(plant, entry, options.how.days);
  if (again && before->until > now() && is_another(before->member, entry.member)) {
    fmt::print(
        "it may other things now; what it has got before goes on counting for what that says, "
        "until "
        "{:%F}, unless {} is revoked\n",
        before->until, entry.member.name);
  }
  return base::program::exit_done;
}

int renew(const NamedOptions& options) {
  tools::trust::Plant plant = open(options);
  say_where(plant, must(plant.renew(options.name, options.days, passphrase_of(options), now())),
            options.days);
  return base::program::exit_done;
}

struct AuthoritiesOptions : PlantOptions {
  int days = InitOptions{}.days;
  int member_days = tools::trust::IssueOptions{}.days;
};

int renew_authorities(const AuthoritiesOptions& options) {
  tools::trust::Plant plant = open(options);
  must(plant.renew_authorities(options.days, options.member_days, passphrase_of(options), now()));
  fmt::print(
      "{0}: the authorities are valid until {1:%F}, and all members are renewed. Copy each "
      "member's "
      "folder to its host and restart its programs, one after the other: what hosts have until "
      "then "
      "goes on counting until its time is over\n",
      options.folder, must(plant.authorities_until()));
  return base::program::exit_done;
}

int revoke(const NamedOptions& options) {
  tools::trust::Plant plant = open(options);
  must(plant.revoke(options.name, passphrase_of(options), now()));
  fmt::print(
      "{0} is revoked. Copy {1}/revoked.pem to all hosts, into the folder that each has: those of "
      "{1} have it already. Programs that have it take {0} no more\n",
      options.name, options.folder);
  return base::program::exit_done;
}

}  // namespace

void add_init(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "init", "Make the authorities of a plant", "millrace trust init plant");
  auto options = std::make_shared<InitOptions>();
  add_plant(command, *options);
  add_passphrase(command, *options);
  command.add_option("--fabric", options->fabric, "The fabric it is for")->capture_default_str();
  command.add_option("--name", options->name,
                     "The plant's name in certificates; else that of the folder");
  command.add_option("--days", options->days, "How long the authorities are valid")
      ->capture_default_str();
  command.callback([options, &chosen] { chosen.run = [options] { return init(*options); }; });
}

void add_issue(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "issue", "Make what a host needs to be something",
                     "millrace trust issue plant gateway-1 --role gateway --machine press_1");
  auto options = std::make_shared<IssueOptions>();
  add_plant(command, *options);
  add_passphrase(command, *options);
  command.add_option("name", options->member.name, "Whom: its folder in the plant's")->required();
  command
      .add_option("--role", options->roles,
                  "gateway, service, operator, observer or tester; several times for several")
      ->required()
      ->allow_extra_args(false);
  command.add_option("--uuid", options->member.uuids, "A UUID that the service may answer")
      ->allow_extra_args(false);
  command.add_option("--machine", options->member.machines, "A machine of the gateway")
      ->allow_extra_args(false);
  command.add_option("--host", options->how.host, "Where it is meant to be, for people");
  command.add_option("--days", options->how.days, "How long it is valid")->capture_default_str();
  command.add_flag("--renew", options->renew,
                   "If it is there, make it new, with what is said here");
  command.add_flag(
      "--foreign", options->how.foreign,
      "For a program on another DDS, Fast DDS say: the others begin the handshake with it");
  command.callback([options, &chosen] { chosen.run = [options] { return issue(*options); }; });
}

void add_renew(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "renew", "Make new material for a member",
                                     "millrace trust renew plant gateway-1");
  auto options = std::make_shared<NamedOptions>();
  add_plant(command, *options);
  add_passphrase(command, *options);
  command.add_option("name", options->name, "Whose")->required();
  command.add_option("--days", options->days, "How long it is valid")->capture_default_str();
  command.callback([options, &chosen] { chosen.run = [options] { return renew(*options); }; });
}

void add_renew_authorities(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      trust, "renew-authorities", "Have the authorities be valid for longer, and renew all members",
      "millrace trust renew-authorities plant");
  auto options = std::make_shared<AuthoritiesOptions>();
  add_plant(command, *options);
  add_passphrase(command, *options);
  command.add_option("--days", options->days, "How long the authorities are valid from now on")
      ->capture_default_str();
  command.add_option("--member-days", options->member_days, "How long the members are")
      ->capture_default_str();
  command.callback(
      [options, &chosen] { chosen.run = [options] { return renew_authorities(*options); }; });
}

void add_revoke(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "revoke", "Take back all that a member ever got",
                                     "millrace trust revoke plant square-root");
  auto options = std::make_shared<NamedOptions>();
  add_plant(command, *options);
  add_passphrase(command, *options);
  command.add_option("name", options->name, "Whose")->required();
  command.callback([options, &chosen] { chosen.run = [options] { return revoke(*options); }; });
}

}  // namespace millrace::tools::commands::trust
