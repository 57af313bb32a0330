// Programs under systemd: they report that they are ready, and then regularly that they are alive.
#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/stuck_loop.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

/// Replaces systemd: the socket of NOTIFY_SOCKET.
class Supervisor {
 public:
  explicit Supervisor(const std::filesystem::path& path)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      throw std::runtime_error("cannot bind " + path.string());
    }
  }
  ~Supervisor() { ::close(socket_); }
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Whether there is a message within this time.
  bool hears(std::chrono::milliseconds time) {
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    return ::poll(&ready, 1, static_cast<int>(time.count())) == 1;
  }

  /// The next message.
  std::string hear() {
    if (!hears(patience)) {
      throw std::runtime_error("nothing heard");
    }
    std::array<char, 1024> buffer{};
    const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
    return {buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

 private:
  int socket_;
};

class Supervised : public testing::TestWithParam<std::vector<std::string>> {
 protected:
  Process start() {
    std::vector<std::string> command{
        "/usr/bin/env",         "-C",
        folder.path().string(), "NOTIFY_SOCKET=" + (folder.path() / "notify").string(),
        "WATCHDOG_USEC=100000", binary(GetParam().front())};
    command.insert(command.end(), GetParam().begin() + 1, GetParam().end());
    command.insert(command.end(), {"--domain", std::to_string(domain.number())});
    return Process(command);
  }
  void await(const std::string& message) {
    while (!supervisor.hear().starts_with(message)) {
    }
  }

  TemporaryFolder folder;
  Domain domain;
  Supervisor supervisor{folder.path() / "notify"};
};

TEST_P(Supervised, ReportsThatItIsReadyAndAlive) {
  Process sut = start();
  bool ready = false;
  int signs_of_life = 0;
  while (!ready || signs_of_life < 3) {
    const std::string message = supervisor.hear();
    ready = ready || message.starts_with("READY=1");
    signs_of_life += message == "WATCHDOG=1" ? 1 : 0;
  }
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
}

TEST_P(Supervised, ReportsNothingWhileItsLoopHangs) {
  constexpr std::chrono::milliseconds several_periods{300};
  Process sut = start();
  await("READY=1");
  await("WATCHDOG=1");
  const bool is_service = GetParam().front() == "millrace-square-root";
  {
    const StuckLoop stuck(sut, is_service ? "loop" : "");
    // Messages from before.
    while (supervisor.hears({})) {
      supervisor.hear();
    }
    EXPECT_FALSE(supervisor.hears(several_periods));
  }
  await("WATCHDOG=1");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
}

INSTANTIATE_TEST_SUITE_P(Programs, Supervised,
                         testing::Values(std::vector<std::string>{"millrace-square-root"},
                                         // The command line of millrace-recorder.service.
                                         std::vector<std::string>{
                                             "millrace", "record", "--rotate-time", "24h",
                                             "--rotate-size", "256MiB", "--min-free", "1MiB"},
                                         std::vector<std::string>{"millrace-gateway"}),
                         [](const auto& tested) {
                           std::string name = tested.param.front();
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace millrace::tests
