#include "tools/mcap/repair_file.hpp"

#include <fmt/format.h>

#include "tools/mcap/file.hpp"

namespace millrace::tools::mcap {

std::filesystem::path repaired_name(const std::filesystem::path& damaged) {
  std::filesystem::path name = damaged;
  if (name.extension() == ".part") {
    name.replace_extension();
  }
  const std::string extension = name.extension().string();
  return name.replace_extension(".repaired" + extension);
}

std::filesystem::path free_repaired_name(const std::filesystem::path& damaged) {
  const std::filesystem::path first = repaired_name(damaged);
  std::filesystem::path name = first;
  for (unsigned number = 2; std::filesystem::exists(name) || std::filesystem::exists(part_of(name));
       ++number) {
    name.replace_filename(
        fmt::format("{}-{}{}", first.stem().string(), number, first.extension().string()));
  }
  return name;
}

tl::expected<RepairReport, std::string> repair_file(const std::filesystem::path& damaged,
                                                    const std::filesystem::path& repaired,
                                                    const std::string& library,
                                                    const Revise& revise) {
  auto source = FileSource::open(damaged);
  if (!source) {
    return tl::unexpected(source.error());
  }
  auto sink = FileSink::create(repaired);
  if (!sink) {
    return tl::unexpected(sink.error());
  }
  auto report = repair(*source, *sink, library, revise);
  if (!report) {
    sink->discard();
    return tl::unexpected(damaged.string() + ": " + report.error());
  }
  if (auto finished = sink->finish(); !finished) {
    sink->discard();
    return tl::unexpected(finished.error());
  }
  return report;
}

}  // namespace millrace::tools::mcap
