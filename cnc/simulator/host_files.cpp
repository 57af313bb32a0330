#include "cnc/simulator/host_files.hpp"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/openssl/certificate.hpp"
#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"

namespace millrace::cnc::simulator {

namespace fs = std::filesystem;

namespace {

using base::posix::Fd;

/// The whole text of an open file with the name `file`.
tl::expected<Program, std::string> text_of(const Fd& open, const fs::path& file) {
  const auto refused = [&](const std::string& why) {
    return tl::unexpected(fmt::format("{} cannot be read: {}", file.string(), why));
  };
  struct stat status {};
  if (::fstat(open.get(), &status) != 0) {
    return refused(std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) {
    return refused(S_ISDIR(status.st_mode) ? "it is a folder" : "it is not a regular file");
  }
  if (status.st_size > longest_program) {
    return refused(fmt::format("it has {} bytes; an NC program has at most {}", status.st_size,
                               longest_program));
  }
  Program program{file.string(), std::string(static_cast<std::size_t>(status.st_size) + 1, '\0')};
  std::size_t size = 0;
  while (size < program.text.size()) {
    const ssize_t got = ::read(open.get(), program.text.data() + size, program.text.size() - size);
    if (got == 0) {
      break;
    }
    if (got < 0 && errno != EINTR) {
      return refused(std::strerror(errno));
    }
    size += got < 0 ? 0 : static_cast<std::size_t>(got);
  }
  if (size == program.text.size()) {
    return refused("it grew while it was read");
  }
  program.text.resize(size);
  return program;
}

/// The part of an absolute name beneath the folder; any other name unchanged.
fs::path beneath(const fs::path& folder, const fs::path& name) {
  if (!name.is_absolute()) {
    return name;
  }
  const fs::path rest = name.lexically_relative(fs::absolute(folder).lexically_normal());
  return rest.empty() || *rest.begin() == ".." || *rest.begin() == "." ? name : rest;
}

}  // namespace

tl::expected<Program, std::string> read_program(const fs::path& file) {
  // A pipe or a device does not block.
  const Fd open(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!open) {
    return tl::unexpected(
        fmt::format("{} cannot be read: {}", file.string(), std::strerror(errno)));
  }
  return text_of(open, file);
}

ProgramFolders::ProgramFolders(std::vector<fs::path> folders) : folders_(std::move(folders)) {}

tl::expected<Program, std::string> ProgramFolders::load(std::string_view name) {
  std::string searched;
  for (const fs::path& folder : folders_) {
    const fs::path written = beneath(folder, name);
    const fs::path place = base::posix::find_ignoring_case(folder, written).value_or(written);
    const fs::path file = folder / place;
    const auto open = base::posix::open_beneath(folder, place, O_RDONLY);
    if (open) {
      return text_of(*open, file);
    }
    std::error_code unreadable;
    const bool is_there = fs::exists(fs::symlink_status(file, unreadable));
    searched += (searched.empty() ? "" : ", ") + folder.string() +
                (is_there ? " (" + open.error() + ")" : "");
  }
  return tl::unexpected(fmt::format("program {} is in none of the folders {}", name, searched));
}

namespace {

/// "2026-03-01 07:00:00.123 "
std::string stamp(std::chrono::system_clock::time_point now) {
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  const std::tm time = fmt::localtime(std::chrono::system_clock::to_time_t(now));
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} ", time, milliseconds);
}

}  // namespace

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
  const std::string line = fmt::format("{}{}{}", saved.time_stamp ? stamp(now) : "", saved.text,
                                       saved.line_end ? "\n" : "");
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

namespace {

ads::Route route_of(const std::string& line, const std::filesystem::path& file) {
  std::istringstream words(line);
  std::string net_id;
  std::string fingerprint;
  words >> net_id >> fingerprint;
  const auto id = ads::NetId::parse(net_id);
  const auto parsed = base::openssl::parse_fingerprint(fingerprint);
  if (!id || (!fingerprint.empty() && !parsed)) {
    throw std::runtime_error(fmt::format(
        "{}: \"{}\"; expected a NetId and a fingerprint, as in 192.168.10.20.1.1 AB:CD:…",
        file.string(), line));
  }
  return {*id, parsed.value_or("")};
}

std::string text_of(const ads::Routes& routes) {
  std::string text;
  for (const ads::Route& route : routes.all()) {
    text += fmt::format("{} {}\n", route.net_id.to_string(), route.fingerprint);
  }
  return text;
}

}  // namespace

std::shared_ptr<ads::Routes> read_routes(const std::filesystem::path& file,
                                         const base::program::Log& log) {
  auto routes = std::make_shared<ads::Routes>();
  const bool is_there = !file.empty() && std::filesystem::exists(file);
  const tl::expected<std::string, std::string> text =
      is_there ? base::posix::read_regular(file) : tl::expected<std::string, std::string>();
  if (!text) {
    throw std::runtime_error(
        fmt::format("{}: the file of routes cannot be read: {}", file.string(), text.error()));
  }
  std::istringstream in(*text);
  for (std::string line; std::getline(in, line);) {
    routes->add(route_of(line, file));
  }
  routes->on_added([file, log, known = std::weak_ptr(routes)](const ads::Route& route) {
    log->info("route added to NetId {}{}", route.net_id.to_string(),
              route.fingerprint.empty() ? "" : ", fingerprint " + route.fingerprint);
    const auto all = known.lock();
    const auto written = file.empty() || !all ? tl::expected<void, std::string>()
                                              : base::posix::write_durably(file, text_of(*all));
    if (!written) {
      log->error("this route is not kept after a restart: {}", written.error());
    }
  });
  return routes;
}

}  // namespace millrace::cnc::simulator
