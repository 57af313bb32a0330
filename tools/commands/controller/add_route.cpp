// millrace controller add-route: adds a route to this host in a controller.
#include <future>
#include <random>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/use_future.hpp>
#include <fmt/format.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/posix/files.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/ads/secure_handshake.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/controller/controller.hpp"

namespace millrace::tools::commands::controller {

namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
namespace program = base::program;
using asio::ip::udp;

struct RouteOptions {
  std::string host;
  std::string net_id;
  std::string user;
  fs::path password_file;
  fs::path self_signed;
  std::string fingerprint;
  bool plain = false;
  bool temporary = false;
  std::string name;
  std::string address;
  std::uint16_t port = 0;
};

/// The values of the command; texts are in CP1252.
struct Job {
  const RouteOptions& options;
  cnc::ads::NetId net_id;
  cnc::ads::RouteOwner owner;
};

std::string in_cp1252(const std::string& what, const std::string& text) {
  constexpr std::size_t longest = 200;
  const auto converted = base::text::to_cp1252(text);
  if (!converted) {
    throw program::UsageError(fmt::format("{}: {}", what, converted.error()));
  }
  if (converted->empty() || converted->size() > longest) {
    throw program::UsageError(
        fmt::format("{}: {} characters; expected 1 to {}", what, converted->size(), longest));
  }
  return *converted;
}

std::string password_of(const RouteOptions& options) {
  if (options.password_file.empty()) {
    return read_hidden(fmt::format("Password of {} on {}", options.user, options.host));
  }
  return program::must(
      base::posix::read_first_line(options.password_file).map_error([&](const std::string& why) {
        return fmt::format("--password-file {}: {}", options.password_file.string(), why);
      }));
}

Job job_of(const RouteOptions& options) {
  const auto net_id = cnc::ads::NetId::parse(options.net_id);
  if (!net_id) {
    throw program::UsageError(
        fmt::format("--net-id {}: expected six numbers, as in 192.168.10.20.1.1", options.net_id));
  }
  if (options.plain == !options.self_signed.empty()) {
    throw program::UsageError(
        "expected either --self-signed FOLDER (Secure ADS) or --plain (the password travels in "
        "clear text)");
  }
  if (options.temporary && !options.plain) {
    throw program::UsageError("--temporary needs --plain: routes of Secure ADS are permanent");
  }
  return {options,
          *net_id,
          {in_cp1252("--user", options.user), in_cp1252("the password", password_of(options))}};
}

void write(const fs::path& file, const std::string& text, mode_t mode) {
  if (const auto written = base::posix::write_durably(file, text, mode); !written) {
    throw std::runtime_error(written.error());
  }
}

/// The files in the folder; created if they are missing.
cnc::ads::SelfSigned own_certificate(const fs::path& folder) {
  const fs::path certificate = certificate_in(folder);
  const fs::path key = key_in(folder);
  if (!fs::exists(certificate) && !fs::exists(key)) {
    constexpr auto validity = std::chrono::years(20);
    constexpr mode_t secret = 0640;
    constexpr mode_t open = 0644;
    const auto made = base::openssl::Key::generate_rsa();
    const auto now =
        std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    const base::openssl::Subject subject{.organisation = "millrace",
                                         .common_name = asio::ip::host_name(),
                                         .from = now - std::chrono::days(1),
                                         .until = now + std::chrono::seconds(validity)};
    write(key, made.pem(), secret);
    write(certificate, base::openssl::self_signed(made, subject).pem(), open);
    fmt::print("made {} and {}\n", key.string(), certificate.string());
  }
  return certificate_and_key_in(folder);
}

asio::awaitable<void> add_securely(Job job) {
  const RouteOptions& options = job.options;
  const std::uint16_t port = options.port == 0 ? cnc::ads::secure_port : options.port;
  cnc::ads::SelfSigned security = own_certificate(options.self_signed);
  security.fingerprint =
      co_await agreed_fingerprint(options.host, port, options.fingerprint, security);
  auto socket = co_await secure_connection(options.host, port);
  cnc::ads::SecureHello hello{security, job.net_id, time_to_answer, job.owner};
  const auto transport = co_await cnc::ads::connect_securely(
      std::move(socket), std::move(hello), [](const std::weak_ptr<cnc::ads::Stream>&) {});
  if (!transport) {
    throw std::runtime_error(
        fmt::format("{}: no route was added: {}", options.host, transport.error().text));
  }
  config::Machine machine;
  machine.set_name("…");
  machine.set_host(options.host);
  machine.set_net_id("…");
  machine.set_source_net_id(job.net_id.to_string());
  config::SecureSelfSigned& block = *machine.mutable_secure()->mutable_self_signed();
  const fs::path folder = fs::absolute(options.self_signed);
  block.set_certificate(certificate_in(folder));
  block.set_key(key_in(folder));
  block.set_fingerprint(security.fingerprint);
  fmt::print(
      "{} has a route to this host now. In gateway.textproto, with the controller's NetId "
      "(`millrace controller probe` shows it):\n\n{}",
      options.host, block_of(machine));
}

/// The address of this host towards another one.
std::string our_address(const udp::endpoint& towards, asio::io_context& io) {
  udp::socket socket(io);
  socket.connect(towards);
  return socket.local_endpoint().address().to_string();
}

asio::awaitable<void> add_in_clear_text(Job job, asio::io_context& io) {
  const RouteOptions& options = job.options;
  fmt::print(stderr,
             "millrace: the password of {} travels in clear text: any host on its way can read it; "
             "use --self-signed to prevent that\n",
             options.user);
  udp::resolver resolver(io);
  const std::uint16_t port = options.port == 0 ? cnc::ads::discovery_port : options.port;
  const auto found = resolver.resolve(udp::v4(), options.host, std::to_string(port));
  const udp::endpoint controller = found.begin()->endpoint();
  const std::string address =
      options.address.empty() ? our_address(controller, io) : options.address;
  const cnc::ads::RouteRequest route{job.net_id,
                                     options.name.empty() ? asio::ip::host_name() : options.name,
                                     address,
                                     job.owner.user,
                                     job.owner.password,
                                     options.temporary};
  Question question{.datagram = cnc::ads::encode(std::random_device{}(), route),
                    .to = {controller},
                    .patience = time_to_answer};
  const auto answers = co_await ask(std::move(question));
  const auto status =
      answers.empty() ? std::nullopt : cnc::ads::route_status_of(answers.front().second);
  if (!status) {
    throw std::runtime_error(fmt::format(
        "{}: no answer on UDP port {}: is it on, is a firewall between?", options.host, port));
  }
  if (*status != cnc::ads::ErrorCode::none) {
    throw std::runtime_error(fmt::format(
        "{}: no route was added: {}: is {} an administrator of it, and the password right?",
        options.host, cnc::ads::describe(*status), options.user));
  }
  fmt::print("{} has a route from NetId {} to {} now{}\n", options.host, job.net_id.to_string(),
             address, options.temporary ? ", until it is restarted" : "");
}

int add(const RouteOptions& options) {
  asio::io_context io(1);
  Job job = job_of(options);
  std::future<void> added = asio::co_spawn(
      io, options.plain ? add_in_clear_text(std::move(job), io) : add_securely(std::move(job)),
      asio::use_future);
  io.run();
  added.get();
  return program::exit_done;
}

}  // namespace

void add_route(CLI::App& controller, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      controller, "add-route", "Add a route to this host in a controller",
      "millrace controller add-route 192.168.10.5 --net-id 192.168.10.20.1.1 --user Administrator "
      "--self-signed /etc/millrace");
  auto options = std::make_shared<RouteOptions>();
  command.add_option("HOST", options->host, "Name or address of the controller")->required();
  command
      .add_option("--net-id", options->net_id,
                  "The NetId of the gateway (source_net_id of its configuration)")
      ->required();
  command.add_option("--user", options->user, "An administrator of the controller")->required();
  command
      .add_option("--password-file", options->password_file,
                  "File with the password in its first line; default: ask for it")
      ->type_name("FILE");
  command
      .add_option("--self-signed", options->self_signed,
                  "Over Secure ADS, with millrace.key and millrace.crt in this folder; the command "
                  "creates them if they are missing")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command.add_option("--fingerprint", options->fingerprint,
                     "Fingerprint of the controller's certificate; default: ask");
  command.add_flag("--plain", options->plain,
                   "Over UDP, for plain ADS: the password travels in clear text");
  command.add_flag("--temporary", options->temporary,
                   "With --plain: until the controller is restarted");
  command.add_option("--name", options->name,
                     "With --plain: name of the route; default: the name of this host");
  command.add_option(
      "--address", options->address,
      "With --plain: address that the route leads to; default: the address of this host");
  command.add_option("--port", options->port,
                     "Port of the controller; default 8016, with --plain UDP 48899");
  run_if_chosen(command, chosen, options, add);
}

}  // namespace millrace::tools::commands::controller
