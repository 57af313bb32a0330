#include "base/program/supervisor.hpp"

#include <array>
#include <cstdlib>
#include <string>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/loop/loop.hpp"
#include "base/program/command_line.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::base::program {
namespace {

/// Replaces systemd: a socket that this process finds by NOTIFY_SOCKET.
class Supervisor {
 public:
  /// `path` may begin with '@' for the abstract namespace.
  explicit Supervisor(const std::string& path)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (path.front() == '@') {
      address.sun_path[0] = '\0';
    }
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~Supervisor() {
    ::close(socket_);
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
    ::unsetenv("WATCHDOG_PID");
  }
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// The next message; empty if there is none.
  [[nodiscard]] std::string next_message() const {
    std::array<char, 256> buffer{};
    const ssize_t length = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    return length > 0 ? std::string(buffer.data(), static_cast<std::size_t>(length)) : "";
  }

 private:
  int socket_;
};

class TheSupervisor : public testing::Test {
 protected:
  tests::TemporaryFolder folder;
  std::string path = folder.path() / "notify";
};

TEST_F(TheSupervisor, IsNotifiedOfReadinessAndStatus) {
  const Supervisor sut(path);
  ready("serving cnc");
  EXPECT_EQ(sut.next_message(), "READY=1\nSTATUS=serving cnc");
}

TEST_F(TheSupervisor, MayHaveASocketWithoutAFile) {
  const Supervisor sut("@millrace-test-" + std::to_string(::getpid()));
  notify_supervisor("STOPPING=1");
  EXPECT_EQ(sut.next_message(), "STOPPING=1");
}

TEST_F(TheSupervisor, NeedNotExist) {
  notify_supervisor("READY=1");
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  notify_supervisor("READY=1");
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(watchdog_period());
}

TEST_F(TheSupervisor, SetsTheWatchdogPeriod) {
  const Supervisor sut(path);
  ::setenv("WATCHDOG_USEC", "10000000", 1);
  EXPECT_EQ(watchdog_period(), std::chrono::seconds(5));
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(watchdog_period()) << "it watches another process";
  ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
  EXPECT_EQ(watchdog_period(), std::chrono::seconds(5));
  ::setenv("WATCHDOG_USEC", "soon", 1);
  EXPECT_FALSE(watchdog_period());
}

TEST_F(TheSupervisor, GetsSignsOfLifeFromARunningLoop) {
  const Supervisor sut(path);
  ::setenv("WATCHDOG_USEC", "2000", 1);
  boost::asio::io_context io;
  const loop::Watchdog watchdog(io.get_executor());
  EXPECT_EQ(sut.next_message(), "WATCHDOG=1");
  EXPECT_EQ(sut.next_message(), "");
  io.run_one();
  EXPECT_EQ(sut.next_message(), "WATCHDOG=1");
}

}  // namespace
}  // namespace millrace::base::program
