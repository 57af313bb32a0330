#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "base/posix/output_file.hpp"
#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "base/text/times.hpp"
#include "services/archiver/config.hpp"
#include "services/archiver/query.hpp"

namespace millrace::services::archiver {

namespace {

namespace program = base::program;
using base::posix::OutputFile;

/// The flags as typed, before they are parsed.
struct Flags {
  std::string config;
  std::string folder;
  std::string since;
  std::string until;
  std::string where;
  Filter filter;
};

void add_flags(CLI::App& app, Flags& flags) {
  static const std::map<std::string, Kind> kinds{{"put", Kind::put},
                                                 {"event", Kind::event},
                                                 {"channel", Kind::channel},
                                                 {"sample", Kind::sample},
                                                 {"program", Kind::program}};
  auto* const config = app.add_option("--config", flags.config, "archiver.textproto of the archive")
                           ->type_name("FILE");
  app.add_option("--folder", flags.folder, "Folder of the archive (default archive)")
      ->type_name("DIR")
      ->excludes(config);
  program::add_choice(app, "--kind", flags.filter.kind, kinds, "Table whose rows are shown")
      ->default_str("put");
  app.add_option("--from", flags.since,
                 "UTC time as in 2026-03-01T07:00, or a time before now as in 15m, 12h, 7d");
  app.add_option("--to", flags.until, "The same; this time is not included");
  app.add_option("--machine", flags.filter.machine, "Only of this machine");
  app.add_option("--channel", flags.filter.channel, "Only of this channel");
  app.add_option("--call", flags.filter.call, "Call id, as in logs");
  app.add_option("--group", flags.filter.group, "Samples of this group");
  app.add_option("--variable", flags.filter.variable, "Samples of this variable");
  app.add_option("--where", flags.where, "Puts with this KEY, or KEY=VALUE");
}

fabric::Time time_or_throw(const std::string& flag, const std::string& text) {
  return program::must(
      base::text::parse_time(text, std::chrono::system_clock::now())
          .map_error([&](const std::string& mistake) { return flag + ": " + mistake; }));
}

Filter filter_from(const Flags& flags) {
  Filter filter = flags.filter;
  if (!flags.since.empty()) {
    filter.since = time_or_throw("--from", flags.since);
  }
  if (!flags.until.empty()) {
    filter.until = time_or_throw("--to", flags.until);
  }
  if (filter.kind != Kind::sample && (filter.group || filter.variable)) {
    throw program::UsageError("--group and --variable need --kind sample");
  }
  if (filter.call && (filter.kind == Kind::sample || filter.kind == Kind::program)) {
    throw program::UsageError("--call: samples and events of NC programs belong to no call");
  }
  if (!flags.where.empty()) {
    if (filter.kind != Kind::put) {
      throw program::UsageError("--where: only puts have fields");
    }
    const std::size_t equals = flags.where.find('=');
    filter.key = flags.where.substr(0, equals);
    if (equals != std::string::npos) {
      filter.value = flags.where.substr(equals + 1);
    }
  }
  return filter;
}

std::filesystem::path folder_from(const Flags& flags) {
  if (!flags.config.empty()) {
    return program::must(load(flags.config)).folder;
  }
  std::filesystem::path folder = flags.folder.empty() ? "archive" : flags.folder;
  if (!std::filesystem::is_directory(folder)) {
    throw program::UsageError("--folder: " + folder.string() + " is not a folder");
  }
  return folder;
}

/// Reports what could not be read, finishes `out` if any file could be read, and returns the exit
/// code.
int finish(OutputFile& out, const Found& found) {
  if (found.read) {
    if (const auto done = out.finish(); !done) {
      throw std::runtime_error(done.error());
    }
  }
  for (const std::string& file : found.unread) {
    fmt::print(stderr, "millrace-archiver: cannot be read: {}\n", base::text::safe(file));
  }
  return found.unread.empty() ? program::exit_done : program::exit_failed;
}

}  // namespace

int query(int argc, char** argv) {
  CLI::App app{"Shows rows of the archive", "millrace-archiver query"};
  Flags flags;
  add_flags(app, flags);
  app.add_option("--count", flags.filter.limit, "At most COUNT rows, the oldest first");
  return program::run(app, argc, argv, [&] {
    const Filter filter = filter_from(flags);
    OutputFile out;
    const Found found = write_rows(folder_from(flags), filter, Format::text, out.stream());
    return finish(out, found);
  });
}

int export_rows(int argc, char** argv) {
  static const std::map<std::string, Format> formats{{"csv", Format::csv},
                                                     {"jsonl", Format::jsonl}};
  CLI::App app{"Writes rows of the archive as CSV or JSON", "millrace-archiver export"};
  Flags flags;
  add_flags(app, flags);
  Format format = Format::csv;
  std::string output;
  program::add_choice(app, "--format", format, formats, "jsonl is one JSON object per line")
      ->required();
  app.add_option("--output", output, "File to write (default standard output)")->type_name("FILE");
  return program::run(app, argc, argv, [&] {
    const Filter filter = filter_from(flags);
    const std::filesystem::path folder = folder_from(flags);
    OutputFile out;
    if (const auto opened = out.open(output); !opened) {
      throw program::UsageError("--output: " + opened.error());
    }
    const Found found = write_rows(folder, filter, format, out.stream());
    return finish(out, found);
  });
}

}  // namespace millrace::services::archiver
