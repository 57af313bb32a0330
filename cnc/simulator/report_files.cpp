#include "cnc/simulator/report_files.hpp"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace {

std::string stamp(std::string form, std::chrono::system_clock::time_point now) {
  constexpr std::string_view fraction = "%f";
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  if (const std::size_t at = form.find(fraction); at != std::string::npos) {
    form.replace(at, fraction.size(), fmt::format("{:03}", milliseconds));
  }
  const std::tm time = fmt::localtime(std::chrono::system_clock::to_time_t(now));
  std::ostringstream out;
  out << std::put_time(&time, form.c_str());
  return out.str();
}

bool leaves_its_folder(const std::filesystem::path& file) {
  const auto normal = file.lexically_normal();
  return normal.is_absolute() || normal.empty() || *normal.begin() == "..";
}

}  // namespace

ReportFiles::ReportFiles(std::filesystem::path folder) : ReportFiles(std::move(folder), Form()) {}

ReportFiles::ReportFiles(std::filesystem::path folder, Form form)
    : folder_(std::move(folder)), form_(std::move(form)) {}

tl::expected<void, std::string> ReportFiles::append(const nc::SaveEvent& saved,
                                                    std::chrono::system_clock::time_point now) {
  const std::filesystem::path file = folder_ / saved.file;
  if (leaves_its_folder(saved.file)) {
    return tl::unexpected(fmt::format("report file {} is not written: it is outside of {}",
                                      saved.file, folder_.string()));
  }
  std::ofstream out(file, std::ios::binary | std::ios::app);
  const char* const quote = form_.quoted ? "\"" : "";
  out << (saved.time_stamp ? stamp(form_.time, now) : "") << quote << saved.text << quote
      << (saved.line_end ? "\n" : "");
  out.flush();
  if (!out) {
    return tl::unexpected(
        fmt::format("report file {} cannot be written: {}", file.string(), std::strerror(errno)));
  }
  return {};
}

}  // namespace millrace::cnc::simulator
