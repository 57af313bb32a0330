#include "tools/commands/lint/lint.hpp"

#include <array>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/program/command_line.hpp"
#include "base/program/version.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/lint/finding.hpp"
#include "tools/lint/lint.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::lint {

namespace {

// The files that `millrace lint` reads.

using base::program::UsageError;

/// The parser reports files over 16 MiB.
constexpr std::size_t most_bytes = (std::size_t{16} << 20U) + 1;

/// Nothing if it cannot be read.
std::optional<std::string> read_all(int fd) {
  std::string text;
  std::array<char, 65536> part{};
  while (text.size() < most_bytes) {
    const ssize_t size = ::read(fd, part.data(), part.size());
    if (size < 0 && errno == EINTR) {
      continue;
    }
    if (size < 0) {
      return std::nullopt;
    }
    if (size == 0) {
      break;
    }
    text.append(part.data(), static_cast<std::size_t>(size));
  }
  return text;
}

std::string read_file(const std::filesystem::path& file) {
  auto text = base::posix::read_regular(file);
  if (!text) {
    throw UsageError(
        fmt::format("cannot read {}: {}; - reads standard input", file.string(), text.error()));
  }
  return *std::move(text);
}

/// A program by its name, "-" for standard input. Throws base::program::UsageError if it cannot be
/// read.
tools::lint::Source read_program(const std::string& name) {
  if (name != "-") {
    return {name, read_file(name)};
  }
  auto text = read_all(STDIN_FILENO);
  if (!text) {
    throw UsageError(base::posix::last_error("cannot read standard input"));
  }
  return {"<stdin>", *std::move(text)};
}

/// The first plain file of this name beneath one of the folders; nothing if there is none.
std::optional<tools::lint::Source> find_program(const std::vector<std::filesystem::path>& folders,
                                                const std::string& name) {
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path where = folder.empty() ? std::filesystem::path(".") : folder;
    const auto found = base::posix::find_ignoring_case(where, name);
    if (!found) {
      continue;
    }
    if (const auto file = base::posix::open_beneath(where, *found, O_RDONLY)) {
      if (auto text = read_all(file->get())) {
        return tools::lint::Source{(folder / *found).string(), *std::move(text)};
      }
    }
  }
  return std::nullopt;
}

/// The first word of each line that has one and is not a comment (#). Throws
/// base::program::UsageError if the file cannot be read.
std::vector<std::string> read_words(const std::filesystem::path& file) {
  std::istringstream lines(read_file(file));
  std::vector<std::string> words;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream parts(line);
    std::string word;
    if (parts >> word && !word.starts_with('#')) {
      words.push_back(std::move(word));
    }
  }
  return words;
}

namespace checks = tools::lint;

/// There is a finding that fails a build.
constexpr int exit_found = 1;

struct Options : look::SnapshotOptions {
  explicit Options(CLI::App& command) : SnapshotOptions(command) { add_json(command, json); }

  bool json = false;

  std::vector<std::string> programs;
  std::vector<std::string> folders;
  std::vector<std::string> uuids;
  std::string uuid_file;
  std::vector<std::string> off;
  bool live = false;
  bool channels = false;
  bool strict = false;
  bool sarif = false;
  bool rules = false;
};

void print_rules() {
  print::Table table({{"RULE"}, {"SEVERITY"}, {"WHAT"}});
  for (const checks::RuleInfo& rule : checks::rules()) {
    table.add({std::string(rule.name), std::string(checks::name_of(rule.severity)),
               std::string(rule.summary)});
  }
  fmt::print("{}", table.text());
}

/// Nullopt if no option names known services.
std::optional<std::vector<std::string>> known_uuids(const Options& options) {
  if (options.uuids.empty() && options.uuid_file.empty() && !options.live) {
    return std::nullopt;
  }
  std::vector<std::string> known;
  known.reserve(options.uuids.size());
  for (const std::string& uuid : options.uuids) {
    known.push_back(fabric::canonical_uuid(uuid));
  }
  if (!options.uuid_file.empty()) {
    for (const std::string& uuid : read_words(options.uuid_file)) {
      known.push_back(fabric::canonical_uuid(uuid));
    }
  }
  if (options.live) {
    const fabric::plant::Plant live = options.look();
    for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
      known.push_back(instance->identity.uuid);
    }
  }
  return known;
}

checks::LintOptions checks_of(const Options& options) {
  checks::LintOptions wanted{.uuids = known_uuids(options), .channels = options.channels};
  for (const std::string& name : options.off) {
    const auto rule = checks::rule_named(name);
    if (!rule) {
      throw UsageError(
          fmt::format("--off {}: no such rule; `millrace lint --rules` names them", name));
    }
    wanted.off.insert(*rule);
  }
  std::vector<std::filesystem::path> folders(options.folders.begin(), options.folders.end());
  for (const std::string& program : options.programs) {
    // Like the controller: beside the calling program, unless folders are given.
    folders.push_back(std::filesystem::path(program).parent_path());
  }
  wanted.load = [folders = std::move(folders)](const std::string& name) {
    return find_program(folders, name);
  };
  return wanted;
}

int check(const Options& options) {
  if (options.rules) {
    print_rules();
    return base::program::exit_done;
  }
  if (options.programs.empty()) {
    throw UsageError("no NC program is named; expected FILE…, or - for standard input");
  }
  std::vector<checks::Source> programs;
  programs.reserve(options.programs.size());
  for (const std::string& name : options.programs) {
    programs.push_back(read_program(name));
  }
  const checks::Report report = checks::lint(programs, checks_of(options));
  const std::vector<checks::Finding>& findings = report.findings;
  if (options.sarif) {
    print::print_json(checks::sarif_of(findings, report.not_understood, base::program::version()));
  } else if (options.json) {
    print::print_json(checks::json_of(findings, report.not_understood));
  } else {
    for (const checks::Finding& finding : findings) {
      fmt::print("{}", checks::text_of(finding));
    }
    fmt::print("{}\n", checks::summary_of(findings, report.not_understood));
  }
  return checks::fails(findings, options.strict) ? exit_found : base::program::exit_done;
}

}  // namespace

void add_lint(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "lint", "Check NC programs before they run",
                                     "millrace lint --live part.nc");
  auto options = std::make_shared<Options>(command);
  command.add_option("FILE", options->programs, "NC programs; - is standard input");
  // Each may be repeated, and does not take a program for its next value.
  command
      .add_option("--path", options->folders,
                  "Folder of subprograms and cycles, before that of the NC program")
      ->type_name("DIR")
      ->allow_extra_args(false);
  command.add_option("--uuid", options->uuids, "UUID of a known service")->allow_extra_args(false);
  command
      .add_option("--uuids", options->uuid_file,
                  "File with the UUIDs of known services, one in each line")
      ->type_name("FILE");
  command.add_flag("--live", options->live, "The services that are on the fabric now are known");
  command.add_flag("--channels", options->channels,
                   "The NC programs run in different channels at the same time");
  command.add_option("--off", options->off, "Switch this rule off")->allow_extra_args(false);
  command.add_flag("--strict", options->strict, "Exit code 1 also for warnings");
  command.add_flag("--sarif", options->sarif, "Print SARIF, for CI and editors");
  command.add_flag("--rules", options->rules, "Print the rules");
  run_if_chosen(command, chosen, options, check);
}

}  // namespace millrace::tools::commands::lint
