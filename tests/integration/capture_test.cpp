// An eavesdropper on a fabric with trust: what it can read and what it cannot. In a network of its
// own, of which all packets are captured.
#include <array>
#include <atomic>
#include <chrono>
#include <regex>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/posix/system.hpp"
#include "tests/integration/trusted_chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/own_network.hpp"

namespace millrace::tests::integration {
namespace {

/// The UUID of millrace-slow-service.
const std::string uuid = "c0ffee00-0000-4000-8000-000000000001";

const std::string secret = "a secret recipe";

/// Before any test has threads.
class Network : public testing::Environment {
 public:
  void SetUp() override { obstacle = enter_own_network(); }
  inline static std::string obstacle;
};

const testing::Environment* const network = testing::AddGlobalTestEnvironment(new Network);

/// The traffic of DDS: every UDP packet of this network from construction on. ADS, which has no
/// protection, uses TCP.
class Capture {
 public:
  Capture() : socket_(::socket(AF_PACKET, SOCK_RAW, htons(ETH_P_IP))) {
    sockaddr_ll where{};
    where.sll_family = AF_PACKET;
    where.sll_protocol = htons(ETH_P_IP);
    where.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): what bind() takes.
    if (!socket_ || ::bind(socket_.get(), reinterpret_cast<sockaddr*>(&where), sizeof where) != 0) {
      throw std::runtime_error(base::posix::last_error("capturing packets"));
    }
    thread_ = std::thread([this] { run(); });
  }
  ~Capture() { end(); }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  [[nodiscard]] std::size_t packets() const { return packets_; }
  /// Stops the capture and returns all of it.
  const std::string& end() {
    over_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
    return bytes_;
  }

 private:
  void run() {
    std::array<char, 65'536> packet{};
    constexpr std::size_t protocol_at = sizeof(ethhdr) + offsetof(iphdr, protocol);
    while (!over_) {
      pollfd ready{socket_.get(), POLLIN, 0};
      if (::poll(&ready, 1, 20) <= 0) {
        continue;
      }
      const ssize_t size = ::recv(socket_.get(), packet.data(), packet.size(), MSG_DONTWAIT);
      if (size > static_cast<ssize_t>(protocol_at) && packet.at(protocol_at) == IPPROTO_UDP) {
        bytes_.append(packet.data(), static_cast<std::size_t>(size));
        ++packets_;
      }
    }
  }

  base::posix::Fd socket_;
  std::string bytes_;
  std::atomic<std::size_t> packets_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

class CapturedPackets : public testing::Test {
 protected:
  void SetUp() override {
    if (!Network::obstacle.empty()) {
      GTEST_SKIP() << Network::obstacle;
    }
  }

  /// A program that sends the same text again and again and checks that the answers contain it.
  [[nodiscard]] std::string program_with_secret() const {
    const std::string counting = content_of(chain_.counting_program(uuid, 1'000'000));
    const fs::path file = chain_.folder() / "secretive.nc";
    std::ofstream(file) << std::regex_replace(counting, std::regex(R"(INT_TO_STR\[P1\])"),
                                              fmt::format("\"{}\"", secret));
    return file;
  }

  /// The traffic while a program calls, after discovery.
  std::string capture_calls(const std::string& protection) {
    const TrustCredentials plant(chain_.folder(), {uuid}, protection);
    Process service = chain_.slow_service({"--fabric-config", plant.profile("service")});
    Process cnc = chain_.cnc({"--channels", "1", "--run", "1=" + program_with_secret()});
    Process gateway =
        chain_.gateway({"--fabric-config", plant.profile("gateway"), "--log-level", "debug"});
    gateway.await_error("answered with state");
    Capture sut;
    await("packets of calls", [&] { return sut.packets() > 200; });
    const std::string seen = sut.end();
    EXPECT_EQ(cnc.output().find("wrong answer"), std::string::npos);
    return seen;
  }

  Chain chain_;
};

// The counterpart: it proves that the next test would find readable text.
TEST_F(CapturedPackets, ShowWhatIsOnlySigned) {
  const std::string seen = capture_calls("SIGN");
  EXPECT_NE(seen.find(uuid), std::string::npos);
  EXPECT_NE(seen.find(secret), std::string::npos);
}

TEST_F(CapturedPackets, ShowNeitherTextNorUuidOfAnEncryptedCall) {
  const std::string seen = capture_calls("ENCRYPT");
  EXPECT_GT(seen.size(), 10'000U);
  EXPECT_EQ(seen.find(uuid), std::string::npos);
  EXPECT_EQ(seen.find(secret), std::string::npos);
  EXPECT_EQ(seen.find("millrace/"), std::string::npos) << "the name of a topic or a partition";
}

TEST_F(CapturedPackets, ShowNeitherProcessNorHostOfAJoiningProcess) {
  const TrustCredentials plant(chain_.folder(), {uuid}, "ENCRYPT");
  Capture sut;
  Process service = chain_.slow_service({"--fabric-config", plant.profile("service")});
  Process cnc = chain_.cnc();
  Process gateway = chain_.gateway({"--fabric-config", plant.profile("gateway")});
  gateway.await_error("is ready");
  const std::string& seen = sut.end();
  EXPECT_EQ(seen.find("__Pid"), std::string::npos);
  EXPECT_EQ(seen.find("__Hostname"), std::string::npos);
  EXPECT_EQ(seen.find("millrace-slow-service"), std::string::npos);
  EXPECT_EQ(seen.find("millrace-gateway"), std::string::npos);
}

// The handshake of DDS Security sends certificates and permissions before there is a key.
TEST_F(CapturedPackets, ShowThePermissionsOfAJoiningProcess) {
  const TrustCredentials plant(chain_.folder(), {uuid}, "ENCRYPT");
  Capture sut;
  Process service = chain_.slow_service({"--fabric-config", plant.profile("service")});
  Process cnc = chain_.cnc();
  Process gateway = chain_.gateway({"--fabric-config", plant.profile("gateway")});
  gateway.await_error("is ready");
  EXPECT_NE(sut.end().find(uuid), std::string::npos);
}

}  // namespace
}  // namespace millrace::tests::integration
