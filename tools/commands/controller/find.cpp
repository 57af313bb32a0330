// millrace controller find: the controllers that answer an identify request.
#include <future>
#include <random>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/network_v4.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/json/array.hpp>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"
#include "tools/commands/controller/controller.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::controller {

namespace {

namespace asio = boost::asio;
namespace program = base::program;
using asio::ip::udp;

struct FindOptions {
  std::vector<std::string> addresses;
  std::string interface;
  bool broadcast = false;
  std::uint16_t port = cnc::ads::discovery_port;
  bool json = false;
};

struct Found {
  std::string address;
  cnc::ads::Identity identity;
  bool plain = false;
  bool secure = false;
};

asio::ip::address_v4 address_of(const sockaddr* address) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how the system has it
  const auto* const ip = reinterpret_cast<const sockaddr_in*>(address);
  return asio::ip::address_v4(ntohl(ip->sin_addr.s_addr));
}

/// Our address on an interface, and the broadcast address of its network from the netmask: the
/// interface may have none configured. Throws UsageError.
std::pair<asio::ip::address_v4, asio::ip::address_v4> addresses_on(const std::string& interface) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) {
    throw std::runtime_error("cannot list the network interfaces");
  }
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(all, &::freeifaddrs);
  for (const ifaddrs* network = all; network != nullptr; network = network->ifa_next) {
    if (network->ifa_name == interface && network->ifa_addr != nullptr &&
        network->ifa_addr->sa_family == AF_INET && (network->ifa_flags & IFF_BROADCAST) != 0 &&
        network->ifa_netmask != nullptr) {
      const asio::ip::address_v4 address = address_of(network->ifa_addr);
      return {address, asio::ip::network_v4(address, address_of(network->ifa_netmask)).broadcast()};
    }
  }
  throw program::UsageError(
      fmt::format("--interface {}: there is no such interface with an IPv4 address and broadcasts; "
                  "`ip address` "
                  "lists them",
                  interface));
}

Question question_of(const FindOptions& options) {
  Question question{.datagram = cnc::ads::identify_request(std::random_device{}()), .to = {}};
  if (options.addresses.empty() == options.interface.empty()) {
    throw program::UsageError("expected either --address or --interface");
  }
  if (!options.interface.empty()) {
    if (!options.broadcast) {
      throw program::UsageError(
          fmt::format("--interface {}: this sends a broadcast to all hosts of its network; confirm "
                      "with --broadcast",
                      options.interface));
    }
    const auto [from, to] = addresses_on(options.interface);
    question.from = from;
    question.to.emplace_back(to, options.port);
    question.broadcast = true;
  }
  for (const std::string& text : options.addresses) {
    boost::system::error_code error;
    const auto address = asio::ip::make_address_v4(text, error);
    if (error) {
      throw program::UsageError(
          fmt::format("--address {}: expected an IPv4 address, as in 192.168.10.5", text));
    }
    question.to.emplace_back(address, options.port);
  }
  return question;
}

asio::awaitable<bool> answers_on(std::string host, std::uint16_t port) {
  constexpr std::chrono::milliseconds at_most{500};
  const auto socket = co_await cnc::ads::dial(std::move(host), port, at_most);
  co_return socket.has_value();
}

asio::awaitable<std::vector<Found>> find_all(Question question) {
  std::vector<Found> all;
  const auto answers = co_await ask(std::move(question));
  for (const auto& [address, datagram] : answers) {
    if (const auto identity = cnc::ads::identity_of(datagram)) {
      Found found{address, *identity};
      found.plain = co_await answers_on(address, 48898);
      found.secure = co_await answers_on(address, cnc::ads::secure_port);
      all.push_back(std::move(found));
    }
  }
  co_return all;
}

void show(const std::vector<Found>& all, bool json) {
  using base::text::to_utf8;
  if (json) {
    boost::json::array out;
    for (const Found& found : all) {
      out.push_back({{"name", to_utf8(found.identity.name)},
                     {"address", found.address},
                     {"net_id", found.identity.net_id.to_string()},
                     {"twincat", found.identity.twincat},
                     {"system", found.identity.system},
                     {"fingerprint", to_utf8(found.identity.fingerprint)},
                     {"plain_ads", found.plain},
                     {"secure_ads", found.secure}});
    }
    print::print_json(out);
    return;
  }
  print::Table table({{"NAME"},
                      {"ADDRESS"},
                      {"NETID"},
                      {"TWINCAT"},
                      {"SYSTEM"},
                      {"PLAIN ADS"},
                      {"SECURE ADS"},
                      {"FINGERPRINT"}});
  const auto or_dash = [](const std::string& text) { return text.empty() ? "-" : to_utf8(text); };
  for (const Found& found : all) {
    table.add({or_dash(found.identity.name), found.address, found.identity.net_id.to_string(),
               or_dash(found.identity.twincat), or_dash(found.identity.system),
               found.plain ? "open" : "closed", found.secure ? "open" : "closed",
               or_dash(found.identity.fingerprint)});
  }
  fmt::print("{}", table.text());
}

int find(const FindOptions& options) {
  asio::io_context io(1);
  std::future<std::vector<Found>> found =
      asio::co_spawn(io, find_all(question_of(options)), asio::use_future);
  io.run();
  const std::vector<Found> all = found.get();
  if (!all.empty() || options.json) {
    show(all, options.json);
  }
  if (all.empty()) {
    fmt::print(
        stderr,
        "millrace: no controller responded on UDP port {}: check power, firewall and network\n",
        options.port);
  }
  return all.empty() ? program::exit_failed : program::exit_done;
}

}  // namespace

void add_find(CLI::App& controller, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(controller, "find", "Find controllers, with NetId and fingerprint",
                     "millrace controller find --address 192.168.10.5\n"
                     "  millrace controller find --interface eth0 --broadcast");
  auto options = std::make_shared<FindOptions>();
  command.add_option("--address", options->addresses, "IPv4 address to ask; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--interface", options->interface,
                     "Network interface of the broadcast, with --broadcast");
  command.add_flag("--broadcast", options->broadcast,
                   "Send a broadcast to all hosts of the network of --interface");
  command.add_option("--port", options->port, "UDP port of controllers")->capture_default_str();
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, find);
}

}  // namespace millrace::tools::commands::controller
