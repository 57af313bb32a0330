// init, issue, renew, renew-authorities, revoke: the commands that write a PKI folder.

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/commands/trust/trust.hpp"

namespace millrace::tools::commands::trust {

namespace {

using base::program::UsageError;
using fabric::trust::Participant;

struct InitOptions : PkiOptions {
  std::string fabric = "millrace";
  std::string name;
  int days = 3650;
};

struct IssueOptions : PkiOptions {
  Participant participant;
  std::vector<std::string> roles;
  tools::trust::IssueOptions how;
  bool renew = false;
};

struct NamedOptions : PkiOptions {
  std::string name;
  int days = tools::trust::IssueOptions{}.days;
};

void print_location(const tools::trust::PkiFolder& pki, const tools::trust::Entry& entry,
                    int days) {
  fmt::print("{}: valid until {:%F}; copy this folder to its host, and nothing else of {}\n",
             pki.folder_of(entry.participant.name).string(), entry.until,
             pki.folder_of("").parent_path().string());
  if (entry.until < entry.from + std::chrono::days(days)) {
    fmt::print("the CAs expire then: {} days would be longer\n", days);
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
  // "plant/" is "plant", and "." is the current folder.
  const std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  const std::filesystem::path last =
      whole.has_filename() ? whole.filename() : whole.parent_path().filename();
  const std::string name = options.name.empty() ? last.string() : options.name;
  must(tools::trust::PkiFolder::create(folder, name, options.fabric, options.days,
                                       passphrase_of(options), now()));
  fmt::print(
      "{0}: the CAs of {1}, for the fabric {2}. Keep {0}/authorities where only you can read it: "
      "its keys can issue any certificate\nnext: millrace trust issue {0} gateway-1 --role gateway "
      "--machine NAME\n",
      options.folder, name, options.fabric);
  return base::program::exit_done;
}

bool is_another(const Participant& before, const Participant& after) {
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
    options.participant.roles.insert(*role);
  }
  tools::trust::PkiFolder pki = open(options);
  const auto before = pki.entry(options.participant.name);
  const std::string passphrase = passphrase_of(options);
  const bool again = options.renew && before;
  const auto entry = must(again ? pki.reissue(options.participant, options.how, passphrase, now())
                                : pki.issue(options.participant, options.how, passphrase, now()));
  print_location(pki, entry, options.how.days);
  if (again && before->until > now() && is_another(before->participant, entry.participant)) {
    fmt::print(
        "its certificate allows other things now; the earlier one allows what it states until "
        "{:%F}, unless {} is revoked\n",
        before->until, entry.participant.name);
  }
  return base::program::exit_done;
}

int renew(const NamedOptions& options) {
  tools::trust::PkiFolder pki = open(options);
  print_location(pki, must(pki.renew(options.name, options.days, passphrase_of(options), now())),
                 options.days);
  return base::program::exit_done;
}

struct AuthoritiesOptions : PkiOptions {
  int days = InitOptions{}.days;
  int participant_days = tools::trust::IssueOptions{}.days;
};

int renew_authorities(const AuthoritiesOptions& options) {
  tools::trust::PkiFolder pki = open(options);
  must(
      pki.renew_authorities(options.days, options.participant_days, passphrase_of(options), now()));
  fmt::print(
      "{0}: the CAs are valid until {1:%F}, and all participants are renewed. Copy each "
      "participant's folder to its host and restart its processes, one after the other: the "
      "earlier certificates stay valid until they expire\n",
      options.folder, must(pki.authorities_until()));
  return base::program::exit_done;
}

int revoke(const NamedOptions& options) {
  tools::trust::PkiFolder pki = open(options);
  must(pki.revoke(options.name, passphrase_of(options), now()));
  fmt::print(
      "{0} is revoked. Copy {1}/revoked.pem to all hosts, into each participant's folder; the "
      "folders in {1} have it already. Processes that have it reject {0}\n",
      options.name, options.folder);
  return base::program::exit_done;
}

template <typename Options>
std::shared_ptr<Options> options_of(CLI::App& command) {
  auto options = std::make_shared<Options>();
  add_pki_folder(command, *options);
  add_passphrase(command, *options);
  return options;
}

}  // namespace

void add_init(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "init", "Create the CAs of a fabric", "millrace trust init plant");
  const auto options = options_of<InitOptions>(command);
  command.add_option("--fabric", options->fabric, "Name of the fabric")->capture_default_str();
  command.add_option("--name", options->name,
                     "Name of the PKI in certificates; default: the folder's name");
  command.add_option("--days", options->days, "Validity of the CAs")->capture_default_str();
  run_if_chosen(command, chosen, options, init);
}

void add_issue(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "issue", "Issue the credentials of a participant",
                     "millrace trust issue plant gateway-1 --role gateway --machine press_1");
  const auto options = options_of<IssueOptions>(command);
  command
      .add_option("name", options->participant.name,
                  "Participant: the name of its folder in the PKI folder")
      ->required();
  command
      .add_option("--role", options->roles,
                  "gateway, service, operator, observer or tester; may be repeated")
      ->required()
      ->allow_extra_args(false);
  command
      .add_option("--uuid", options->participant.uuids,
                  "A UUID that the service may serve; may be repeated")
      ->allow_extra_args(false);
  command
      .add_option("--machine", options->participant.machines,
                  "A machine of the gateway; may be repeated; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--host", options->how.host, "A note about its host, for people");
  command.add_option("--days", options->how.days, "Validity of the certificate")
      ->capture_default_str();
  command.add_flag("--renew", options->renew,
                   "If the participant exists, issue it again with these values");
  command.add_flag(
      "--foreign", options->how.foreign,
      "For a process with another DDS (Fast DDS, for example): the others begin the handshake");
  run_if_chosen(command, chosen, options, issue);
}

void add_renew(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "renew", "Make new credentials for a participant",
                                     "millrace trust renew plant gateway-1");
  const auto options = options_of<NamedOptions>(command);
  command.add_option("name", options->name, "Whose")->required();
  command.add_option("--days", options->days, "Validity of the certificate")->capture_default_str();
  run_if_chosen(command, chosen, options, renew);
}

void add_renew_authorities(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "renew-authorities", "Renew the CAs and all participants",
                     "millrace trust renew-authorities plant");
  const auto options = options_of<AuthoritiesOptions>(command);
  command.add_option("--days", options->days, "Validity of the CAs from now on")
      ->capture_default_str();
  command
      .add_option("--participant-days", options->participant_days,
                  "Validity of the participants' certificates")
      ->capture_default_str();
  run_if_chosen(command, chosen, options, renew_authorities);
}

void add_revoke(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "revoke", "Revoke all certificates of a participant",
                                     "millrace trust revoke plant square-root");
  const auto options = options_of<NamedOptions>(command);
  command.add_option("name", options->name, "Whose")->required();
  run_if_chosen(command, chosen, options, revoke);
}

}  // namespace millrace::tools::commands::trust
