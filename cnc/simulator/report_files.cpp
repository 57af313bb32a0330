#include "cnc/simulator/report_files.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace {

std::string stamp(std::chrono::system_clock::time_point now) {
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} ",
                     fmt::localtime(std::chrono::system_clock::to_time_t(now)), milliseconds);
}

bool leaves_its_folder(const std::filesystem::path& file) {
  const auto normal = file.lexically_normal();
  return normal.is_absolute() || normal.empty() || *normal.begin() == "..";
}

}  // namespace

ReportFiles::ReportFiles(std::filesystem::path folder, bool quoted)
    : folder_(std::move(folder)), quoted_(quoted) {}

tl::expected<void, std::string> ReportFiles::append(const nc::SaveEvent& saved,
                                                    std::chrono::system_clock::time_point now) {
  const std::filesystem::path file = folder_ / saved.file;
  if (leaves_its_folder(saved.file)) {
    return tl::unexpected(fmt::format("report file {} is not written: it is outside of {}",
                                      saved.file, folder_.string()));
  }
  std::ofstream out(file, std::ios::binary | std::ios::app);
  const char* const quote = quoted_ ? "\"" : "";
  out << (saved.time_stamp ? stamp(now) : "") << quote << saved.text << quote
      << (saved.line_end ? "\n" : "");
  out.flush();
  if (!out) {
    return tl::unexpected(
        fmt::format("report file {} cannot be written: {}", file.string(), std::strerror(errno)));
  }
  return {};
}

}  // namespace millrace::cnc::simulator
