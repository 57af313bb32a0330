#include "tools/commands/trust/trust.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/trust/permissions.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::trust {

namespace {

using base::program::UsageError;
using tools::trust::Entry;

/// From when on a certificate is named for running out.
constexpr auto soon = std::chrono::days(30);

struct ListOptions : PkiOptions {
  bool json = false;
};

struct ShowOptions : ListOptions {
  std::string name;
};

struct ExportOptions : PkiOptions {
  std::string name;
  std::string output;
};

std::vector<std::string> roles_of(const Entry& entry) {
  std::vector<std::string> names;
  names.reserve(entry.participant.roles.size());
  for (const fabric::trust::Role role : entry.participant.roles) {
    names.emplace_back(fabric::trust::name_of(role));
  }
  return names;
}

std::string state_of(const Entry& entry) {
  if (entry.revoked) {
    return "revoked";
  }
  if (entry.until <= now()) {
    return "expired";
  }
  return entry.until <= now() + soon ? "expires soon" : "valid";
}

boost::json::object json_of(const Entry& entry) {
  const auto strings = [](const std::vector<std::string>& texts) {
    return boost::json::array(texts.begin(), texts.end());
  };
  return {{"name", entry.participant.name},
          {"roles", strings(roles_of(entry))},
          {"uuids", strings(entry.participant.uuids)},
          {"machines", strings(entry.participant.machines)},
          {"host", entry.host},
          {"foreign", entry.foreign},
          {"serial", entry.serial},
          {"from", fmt::format("{:%FT%TZ}", entry.from)},
          {"until", fmt::format("{:%FT%TZ}", entry.until)},
          {"state", state_of(entry)}};
}

int list(const ListOptions& options) {
  const tools::trust::PkiFolder pki = look(options);
  const tools::trust::Time end = must(pki.authorities_until());
  if (options.json) {
    boost::json::array participants;
    for (const Entry& entry : pki.entries()) {
      participants.push_back(json_of(entry));
    }
    print::print_json(boost::json::object{{"plant", pki.name()},
                                          {"fabric", pki.fabric()},
                                          {"until", fmt::format("{:%FT%TZ}", end)},
                                          {"participants", std::move(participants)}});
    return base::program::exit_done;
  }
  print::Table table({{"NAME"}, {"ROLE"}, {"OF"}, {"HOST"}, {"UNTIL"}, {"STATE"}});
  for (const Entry& entry : pki.entries()) {
    std::vector<std::string> of = entry.participant.uuids;
    of.insert(of.end(), entry.participant.machines.begin(), entry.participant.machines.end());
    table.add({entry.participant.name, fmt::format("{}", fmt::join(roles_of(entry), ", ")),
               fmt::format("{}", fmt::join(of, ", ")), entry.host,
               fmt::format("{:%F}", entry.until), state_of(entry)});
  }
  fmt::print("{}", table.text());
  // No certificate is valid for longer than the CAs: a year in advance there is time for the next
  // round of renewals.
  if (end <= now() + std::chrono::days(365)) {
    fmt::print("the CAs are valid until {:%F}: `millrace trust renew-authorities {}` before that\n",
               end, options.folder);
  }
  return base::program::exit_done;
}

int show(const ShowOptions& options) {
  const tools::trust::PkiFolder pki = look(options);
  const Entry entry = must(pki.entry(options.name));
  const auto grants = fabric::trust::grants_of(entry.participant, pki.fabric());
  const auto word = [](const fabric::trust::Grant& grant) {
    return grant.access == fabric::trust::Access::write ? "writes" : "reads";
  };
  if (options.json) {
    boost::json::object out = json_of(entry);
    boost::json::array may;
    for (const fabric::trust::Grant& grant : grants) {
      may.push_back(boost::json::object{
          {"way", word(grant)}, {"topic", grant.topic}, {"partition", grant.partition}});
    }
    out["may"] = std::move(may);
    print::print_json(out);
    return base::program::exit_done;
  }
  fmt::print("{} of {}: {}, {} until {:%F}, serial {}\n", entry.participant.name, pki.name(),
             fmt::join(roles_of(entry), ", "), state_of(entry), entry.until, entry.serial);
  if (!entry.host.empty()) {
    fmt::print("note: {}\n", base::text::safe(entry.host));
  }
  if (entry.foreign) {
    fmt::print("on another DDS: the others begin the handshake with it\n");
  }
  for (const std::string& machine : entry.participant.machines) {
    fmt::print("machine {}\n", machine);
  }
  print::Table table({{"MAY"}, {"TOPIC"}, {"PARTITION"}});
  for (const fabric::trust::Grant& grant : grants) {
    table.add({word(grant), grant.topic, grant.partition});
  }
  fmt::print("{}", table.text());
  return base::program::exit_done;
}

/// To the standard output: for `ssh HOST tar -x`.
void print_archive(const std::string& archive) {
  if (::isatty(STDOUT_FILENO) != 0) {
    throw UsageError("-o -: an archive cannot go to a terminal; pipe it, or name a file");
  }
  if (std::fwrite(archive.data(), 1, archive.size(), stdout) != archive.size() ||
      std::fflush(stdout) != 0) {
    throw UsageError(fmt::format("-o -: cannot be written ({})", std::strerror(errno)));
  }
}

int write_archive(const ExportOptions& options) {
  const tools::trust::PkiFolder pki = open(options);
  const std::string archive = must(pki.archive_of(options.name));
  if (options.output == "-") {
    print_archive(archive);
    return base::program::exit_done;
  }
  // It takes the place of what is there, which a device or a pipe would not survive.
  std::error_code none;
  if (std::filesystem::exists(options.output, none) &&
      !std::filesystem::is_regular_file(options.output, none)) {
    throw UsageError(
        fmt::format("-o {}: exists and is not a regular file; expected a file name, or - for the "
                    "standard output",
                    options.output));
  }
  must(base::posix::write_durably(options.output, archive, tools::trust::owner_only));
  fmt::print(
      "{0}: the credentials of {1}, with its private key; on its host "
      "`/usr/share/millrace/install-trust UNIT {0}` puts it in place; then remove it\n",
      options.output, options.name);
  return base::program::exit_done;
}

void add_list(CLI::App& trust, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(trust, "list", "List all participants, their roles and validity",
                     "millrace trust list plant");
  auto options = std::make_shared<ListOptions>();
  add_pki_folder(command, *options);
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, list);
}

void add_show(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "show", "Show what a participant may write and read",
                                     "millrace trust show plant square-root");
  auto options = std::make_shared<ShowOptions>();
  add_pki_folder(command, *options);
  add_json(command, options->json);
  command.add_option("name", options->name, "Who")->required();
  run_if_chosen(command, chosen, options, show);
}

void add_export(CLI::App& trust, Chosen& chosen) {
  CLI::App& command = add_subcommand(trust, "export", "Pack a participant's folder for its host",
                                     "millrace trust export plant square-root -o square-root.tar");
  auto options = std::make_shared<ExportOptions>();
  add_pki_folder(command, *options);
  command.add_option("name", options->name, "Who")->required();
  command
      .add_option("-o,--output", options->output,
                  "The tar archive to write; - for the standard output")
      ->type_name("FILE")
      ->required();
  run_if_chosen(command, chosen, options, write_archive);
}

}  // namespace

void add_pki_folder(CLI::App& command, PkiOptions& options) {
  command.add_option("pki", options.folder, "PKI folder")->required();
}

void add_passphrase(CLI::App& command, PkiOptions& options) {
  command
      .add_option("--passphrase-file", options.passphrase_file,
                  "File whose first line encrypts the keys of the CAs; without it only the "
                  "folder's mode protects them")
      ->type_name("FILE");
}

std::string passphrase_of(const PkiOptions& options) {
  if (options.passphrase_file.empty()) {
    return {};
  }
  const auto line = base::posix::read_first_line(options.passphrase_file);
  if (!line || line->empty()) {
    throw UsageError(fmt::format("--passphrase-file {}: expected a passphrase in its first line{}",
                                 options.passphrase_file, line ? "" : "; " + line.error()));
  }
  return *line;
}

tools::trust::PkiFolder open(const PkiOptions& options) {
  return must(tools::trust::PkiFolder::open(options.folder));
}

tools::trust::PkiFolder look(const PkiOptions& options) {
  return must(tools::trust::PkiFolder::look(options.folder));
}

tools::trust::Time now() {
  return std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
}

void add_trust(CLI::App& app, Chosen& chosen) {
  CLI::App& trust = add_subcommand(app, "trust", "Manage the certificates of a fabric",
                                   "millrace trust init plant");
  trust.require_subcommand(1);
  add_init(trust, chosen);
  add_issue(trust, chosen);
  add_list(trust, chosen);
  add_show(trust, chosen);
  add_renew(trust, chosen);
  add_renew_authorities(trust, chosen);
  add_revoke(trust, chosen);
  add_export(trust, chosen);
}

}  // namespace millrace::tools::commands::trust
