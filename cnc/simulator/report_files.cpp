#include "cnc/simulator/report_files.hpp"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <iomanip>
#include <sstream>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/posix/beneath.hpp"

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

}  // namespace

ReportFiles::ReportFiles(std::filesystem::path folder) : ReportFiles(std::move(folder), Form()) {}

ReportFiles::ReportFiles(std::filesystem::path folder, Form form)
    : folder_(std::move(folder)), form_(std::move(form)) {}

tl::expected<void, std::string> ReportFiles::append(const nc::SaveEvent& saved,
                                                    std::chrono::system_clock::time_point now) {
  const auto refused = [&](const std::string& why) {
    return tl::unexpected(
        fmt::format("report file {} in {} is not written: {}", saved.file, folder_.string(), why));
  };
  const auto file = base::posix::open_beneath(folder_, saved.file, O_WRONLY | O_APPEND | O_CREAT);
  if (!file) {
    return refused(file.error());
  }
  const char* const quote = form_.quoted ? "\"" : "";
  const std::string line = fmt::format("{}{}{}{}{}", saved.time_stamp ? stamp(form_.time, now) : "",
                                       quote, saved.text, quote, saved.line_end ? "\n" : "");
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = ::write(file->get(), rest.data(), rest.size());
    if (written < 0 && errno != EINTR) {
      return refused(std::strerror(errno));
    }
    rest.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
  }
  return {};
}

}  // namespace millrace::cnc::simulator
