// Whether millrace-cnc leaks memory with connections: 1,000 are opened, used and closed, again and
// again, 100 of them at a time. Each reads a variable by name, opens a handle and subscribes to a
// notification, which it leaves for the server to clean up.
//
//   cnc_connections [ROUNDS [CONNECTIONS]]
//
// Prints the resident memory of the process after each round, the first of which fills its pools;
// exit code 1 if it has grown by more than 256 kB since then.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <fmt/format.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/process.hpp"

namespace {

namespace asio = boost::asio;
namespace ads = millrace::cnc::ads;
namespace variables = millrace::cnc::variables;
using asio::ip::tcp;
using millrace::tests::binary;
using millrace::tests::Process;

constexpr int at_a_time = 100;
constexpr long allowed_growth_kb = 256;
constexpr std::uint16_t com_port = 553;

ads::Bytes packet(ads::Command command, std::uint16_t port, const ads::Bytes& payload,
                  std::uint32_t invoke_id) {
  const ads::NetId controller{{127, 0, 0, 1, 1, 1}};
  const ads::NetId client{{127, 0, 0, 1, 2, 1}};
  return ads::encode_packet({{controller, port},
                             {client, 32750},
                             command,
                             ads::flags::ads_command,
                             ads::ErrorCode::none,
                             invoke_id},
                            payload);
}

/// The requests of one connection, in one segment.
ads::Bytes requests() {
  const auto name = variables::encode_name("V.G.SERVICE.REQUEST");
  const std::string symbol = "cnc_tick_counter_r";
  const ads::Bytes symbol_bytes(symbol.begin(), symbol.end());
  ads::Bytes all;
  const auto add = [&all](const ads::Bytes& bytes) {
    all.insert(all.end(), bytes.begin(), bytes.end());
  };
  add(packet(ads::Command::read_write, variables::sda_port,
             ads::encode(ads::ReadWriteRequest{
                 {variables::decoder_group + 1, variables::offset::read_by_name}, 128, name}),
             1));
  add(packet(ads::Command::read_write, com_port,
             ads::encode(ads::ReadWriteRequest{{ads::symbol::handle_by_name, 0}, 4, symbol_bytes}),
             2));
  add(packet(ads::Command::add_notification, com_port,
             ads::encode(ads::AddNotificationRequest{
                 {0x120100, 0x1}, 4, ads::Transmission::cyclic, 0, 10'000}),
             3));
  return all;
}

/// The responses to the read, to the handle, to the subscription.
constexpr std::size_t answer_size = (6 + 32 + 8 + 128) + (6 + 32 + 8 + 4) + (6 + 32 + 8);

void use(asio::io_context& io, std::uint16_t port, int connections) {
  const ads::Bytes question = requests();
  for (int done = 0; done < connections; done += at_a_time) {
    std::vector<tcp::socket> sockets;
    for (int i = 0; i < std::min(at_a_time, connections - done); ++i) {
      sockets.emplace_back(io).connect({asio::ip::address_v4::loopback(), port});
      asio::write(sockets.back(), asio::buffer(question));
    }
    for (tcp::socket& socket : sockets) {
      std::array<std::uint8_t, answer_size> answer;
      asio::read(socket, asio::buffer(answer));
    }
  }
}

/// In kB.
long resident_memory(pid_t pid) {
  return std::lround(1024 * millrace::bench::resident_mib(pid));
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::max(std::atoi(argv[1]), 2) : 5;
  const int connections = argc > 2 ? std::max(std::atoi(argv[2]), 1) : 1'000;
  Process cnc({binary("millrace-cnc"), "--listen", "127.0.0.1:0"});
  const auto port = static_cast<std::uint16_t>(
      std::stoul(cnc.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1)));
  fmt::print("{} connections a round, resident memory in kB\n", connections);
  fmt::print("{:<16}{:>8}\n", "at the start", resident_memory(cnc.pid()));
  asio::io_context io;
  long first = 0;
  long last = 0;
  for (int round = 1; round <= rounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    use(io, port, connections);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    last = resident_memory(cnc.pid());
    first = round == 1 ? last : first;
    fmt::print("after round {:<4}{:>8}   {:.0f} connections/s\n", round, last,
               connections / took.count());
  }
  fmt::print("growth since round 1: {} kB; allowed: {} kB\n", last - first, allowed_growth_kb);
  return last - first <= allowed_growth_kb ? EXIT_SUCCESS : EXIT_FAILURE;
}
