// An attacker sends recorded announcements of others again, under new GUIDs.
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <regex>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/posix/system.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/failures/hostile.hpp"

namespace millrace::tests::failures {
namespace {

/// Sends recorded announcements of participants, with GUIDs of its own, from an address that no
/// host has.
class AReplayer : public AHostileParticipant, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    AHostileParticipant::SetUp();
    if (!IsSkipped() && GetParam() != "Open") {
      chain.with_trust({slow_uuid}, GetParam());
    }
  }

  /// The rule that docs/how-to/secure-a-network.md prints, for hosts of one address on loopback.
  static std::string documented_rule() {
    std::ifstream page(MILLRACE_SOURCE "/docs/how-to/secure-a-network.md");
    std::string rule;
    for (std::string line; std::getline(page, line);) {
      const bool begins = line == "    table inet millrace_flood {";
      if (begins || !rule.empty()) {
        rule += line.substr(4) + '\n';
      }
      if (!rule.empty() && line == "    }") {
        break;
      }
    }
    rule = std::regex_replace(rule, std::regex("\"eth0\""), "\"lo\"");
    return std::regex_replace(rule, std::regex("elements = \\{[^}]*\\}"),
                              "elements = { 127.0.0.1 }");
  }

  void filter_packets() const {
    const std::filesystem::path file = chain.folder() / "millrace.nft";
    std::ofstream(file) << documented_rule();
    Process nft({"/usr/sbin/nft", "-f", file});
    ASSERT_EQ(nft.wait(allowed), 0) << nft.error_output();
  }

  [[nodiscard]] std::uint16_t port() const {
    return static_cast<std::uint16_t>(7400 + 250 * chain.domain());
  }

  static sockaddr_in address(const char* host, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, host, &address.sin_addr);
    return address;
  }

  /// An announcement, byte for byte.
  [[nodiscard]] std::string record() const {
    const base::posix::Fd in(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const int yes = 1;
    ::setsockopt(in.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    ::setsockopt(in.get(), SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes);
    const sockaddr_in group = address("239.255.0.1", port());
    EXPECT_EQ(::bind(in.get(), reinterpret_cast<const sockaddr*>(&group), sizeof group), 0);
    ip_mreq join{};
    join.imr_multiaddr = group.sin_addr;
    ::inet_pton(AF_INET, "127.0.0.1", &join.imr_interface);
    EXPECT_EQ(::setsockopt(in.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &join, sizeof join), 0);
    const std::string announces("\x00\x01\x00\xc2", 4);
    std::string packet;
    while (packet.find(announces) == std::string::npos) {
      packet.resize(65'536);
      const auto size = ::recv(in.get(), packet.data(), packet.size(), 0);
      packet.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    }
    return packet;
  }

  /// Returns the gateway's growth in memory.
  double replay(std::size_t packets) {
    const std::string packet = record();
    constexpr std::size_t header = 8;
    constexpr std::size_t prefix_size = 12;
    const std::string prefix = packet.substr(header, prefix_size);
    const base::posix::Fd out(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    const sockaddr_in own = address("127.0.0.66", 0);
    EXPECT_EQ(::bind(out.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    ::setsockopt(out.get(), IPPROTO_IP, IP_MULTICAST_IF, &own.sin_addr, sizeof own.sin_addr);
    const sockaddr_in group = address("239.255.0.1", port());
    const double before = bench::resident_mib(gateway->pid());
    Flood flood(600, [&](std::size_t i) {
      std::string another = packet;
      std::string guid = prefix;
      std::memcpy(guid.data() + 4, &i, sizeof i);
      for (auto at = another.find(prefix); at != std::string::npos; at = another.find(prefix, at)) {
        another.replace(at, prefix_size, guid);
        at += prefix_size;
      }
      ::sendto(out.get(), another.data(), another.size(), 0,
               reinterpret_cast<const sockaddr*>(&group), sizeof group);
    });
    await(
        "the packets", [&] { return flood.done() >= packets; }, allowed);
    flood.end();
    return bench::resident_mib(gateway->pid()) - before;
  }
};

// docs/how-to/secure-a-network.md gives the cost without the rule.
TEST_P(AReplayer, IsBlockedByThePacketFilterOfTheManual) {
  start();
  filter_packets();
  const double grown = replay(1500);
  expect_calls_unharmed();
  std::cout << fmt::format("the gateway's memory has grown by {:.1f} MiB\n", grown);
  EXPECT_LT(grown, 8.0);
}

INSTANTIATE_TEST_SUITE_P(, AReplayer, testing::Values("Open", "SIGN"),
                         [](const auto& fabric) { return fabric.param; });

}  // namespace
}  // namespace millrace::tests::failures
