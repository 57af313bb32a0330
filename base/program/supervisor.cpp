#include "base/program/supervisor.hpp"

#include <cstddef>
#include <cstdlib>
#include <string>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/text/ascii.hpp"

namespace millrace::base::program {

namespace {

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : std::string_view();
}

}  // namespace

bool is_journal(int fd) {
  const std::string_view stream = environment("JOURNAL_STREAM");
  struct stat file {};
  return !stream.empty() && ::fstat(fd, &file) == 0 &&
         stream == std::to_string(file.st_dev) + ':' + std::to_string(file.st_ino);
}

void notify_supervisor(std::string_view lines) {
  const std::string_view path = environment("NOTIFY_SOCKET");
  sockaddr_un address{};
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return;
  }
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  if (path.front() == '@') {
    address.sun_path[0] = '\0';  // a socket of the abstract namespace
  }
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) {
    return;
  }
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  ::sendto(socket, lines.data(), lines.size(), MSG_NOSIGNAL,
           reinterpret_cast<const sockaddr*>(&address), length);
  ::close(socket);
}

std::optional<std::chrono::microseconds> watchdog_period() {
  const std::string_view process = environment("WATCHDOG_PID");
  if (!process.empty() && text::parse_number<std::int64_t>(process) != ::getpid()) {
    return std::nullopt;
  }
  const auto period = text::parse_number<std::int64_t>(environment("WATCHDOG_USEC"));
  if (!period || *period <= 0) {
    return std::nullopt;
  }
  return std::chrono::microseconds(*period / 2);
}

}  // namespace millrace::base::program
