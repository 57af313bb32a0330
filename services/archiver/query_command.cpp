#include "services/archiver/query_command.hpp"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "base/program/command_line.hpp"
#include "base/text/times.hpp"
#include "services/archiver/config.hpp"
#include "services/archiver/query.hpp"

namespace millrace::services::archiver {

namespace {

namespace program = base::program;

/// Flags as they were typed, before they mean something.
struct Flags {
  std::string config;
  std::string folder;
  std::string since;
  std::string until;
  std::string where;
  Filter filter;
};

void add_flags(CLI::App& app, Flags& flags) {
  static const std::map<std::string, Kind> kinds{
      {"put", Kind::put}, {"event", Kind::event}, {"channel", Kind::channel}};
  auto* const config =
      app.add_option("--config", flags.config, "archiver.textproto of the archive");
  app.add_option("--folder", flags.folder, "Folder of the archive (default archive)")
      ->excludes(config);
  app.add_option("--kind", flags.filter.kind, "put, event or channel (default put)")
      ->transform(CLI::CheckedTransformer(kinds))
      ->default_str("put");
  app.add_option("--since", flags.since, "UTC time 2026-03-01T07:00, or so long ago: 15m, 12h, 7d");
  app.add_option("--until", flags.until, "The same; this time is not included");
  app.add_option("--machine", flags.filter.machine, "Machine of the calls");
  app.add_option("--channel", flags.filter.channel, "Channel of the calls");
  app.add_option("--call", flags.filter.call, "Call id, as in logs");
  app.add_option("--where", flags.where, "Puts with this KEY, or KEY=VALUE");
}

fabric::Time time_or_throw(const std::string& flag, const std::string& text) {
  const auto time = base::text::parse_time(text, std::chrono::system_clock::now());
  if (!time) {
    throw program::UsageError(flag + ": " + time.error());
  }
  return *time;
}

Filter filter_from(const Flags& flags) {
  Filter filter = flags.filter;
  if (!flags.since.empty()) {
    filter.since = time_or_throw("--since", flags.since);
  }
  if (!flags.until.empty()) {
    filter.until = time_or_throw("--until", flags.until);
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
    const auto config = load(flags.config);
    if (!config) {
      throw program::UsageError(config.error());
    }
    return config->folder;
  }
  const std::filesystem::path folder = flags.folder.empty() ? "archive" : flags.folder;
  if (!std::filesystem::is_directory(folder)) {
    throw program::UsageError("--folder: " + folder.string() + " is no folder");
  }
  return folder;
}

void flush_or_throw(std::ostream& out, const std::string& where) {
  if (!out.flush()) {
    throw std::runtime_error(where + ": cannot be written");
  }
}

}  // namespace

int query(int argc, char** argv) {
  CLI::App app{"Shows rows of the archive", "millrace-archiver query"};
  Flags flags;
  add_flags(app, flags);
  app.add_option("--limit", flags.filter.limit, "At most so many rows");
  return program::run(app, argc, argv, [&] {
    write_rows(folder_from(flags), filter_from(flags), Format::text, std::cout);
    flush_or_throw(std::cout, "standard output");
    return program::exit_done;
  });
}

int export_rows(int argc, char** argv) {
  static const std::map<std::string, Format> formats{{"csv", Format::csv},
                                                     {"jsonl", Format::jsonl}};
  CLI::App app{"Writes rows of the archive for other programs", "millrace-archiver export"};
  Flags flags;
  add_flags(app, flags);
  Format format = Format::csv;
  std::string output;
  app.add_option("--format", format, "csv or jsonl (one JSON object per line)")
      ->required()
      ->transform(CLI::CheckedTransformer(formats));
  app.add_option("--output", output, "File to write (default standard output)");
  return program::run(app, argc, argv, [&] {
    std::ofstream file;
    if (!output.empty()) {
      file.open(output, std::ios::binary | std::ios::trunc);
    }
    std::ostream& out = output.empty() ? std::cout : file;
    if (!out) {
      throw program::UsageError("--output: " + output + " cannot be written");
    }
    write_rows(folder_from(flags), filter_from(flags), format, out);
    flush_or_throw(out, output.empty() ? "standard output" : output);
    return program::exit_done;
  });
}

}  // namespace millrace::services::archiver
