// millrace controller probe: what a controller offers to a gateway, and its configuration.
#include "cnc/variables/probe.hpp"

#include <algorithm>
#include <cctype>
#include <future>
#include <memory>
#include <optional>
#include <random>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/ads/stream.hpp"
#include "gateway/settings/client_options.hpp"
#include "tools/commands/controller/controller.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::controller {

namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
namespace program = base::program;
using asio::ip::udp;
using cnc::variables::Answer;
using cnc::variables::Verdict;
using gateway::settings::MachineSettings;

struct ProbeOptions {
  std::string host;
  std::string net_id;
  std::string controller_net_id;
  std::uint16_t port = 0;
  std::uint16_t udp_port = cnc::ads::discovery_port;
  std::string psk;
  fs::path password_file;
  fs::path self_signed;
  std::string fingerprint;
  fs::path ca;
  fs::path certificate;
  fs::path key;
  std::string common_name;
  bool json = false;

  [[nodiscard]] bool is_secure() const {
    return !psk.empty() || !self_signed.empty() || !ca.empty();
  }
};

struct Report {
  std::optional<cnc::ads::Identity> identity;
  std::vector<Answer> answers;
  std::uint32_t channels = 0;
  /// For gateway.textproto.
  std::string block;

  [[nodiscard]] bool ready() const {
    return std::ranges::count(answers, Verdict::missing, &Answer::verdict) == 0;
  }
};

void check(const ProbeOptions& options) {
  const auto modes = static_cast<int>(!options.psk.empty()) +
                     static_cast<int>(!options.self_signed.empty()) +
                     static_cast<int>(!options.ca.empty());
  if (modes > 1) {
    throw program::UsageError("expected one of --psk, --self-signed and --ca, or none");
  }
  if (options.psk.empty() != options.password_file.empty()) {
    throw program::UsageError("--psk needs --password-file, and the other way round");
  }
  if (options.ca.empty() != options.certificate.empty() ||
      options.ca.empty() != options.key.empty()) {
    throw program::UsageError("--ca, --certificate and --key need each other");
  }
  if (options.json && !options.self_signed.empty() && options.fingerprint.empty()) {
    throw program::UsageError("--json asks no questions; add --fingerprint");
  }
}

/// Throws std::runtime_error.
udp::endpoint endpoint_of(const ProbeOptions& options, const asio::any_io_executor& executor) {
  udp::resolver resolver(executor);
  boost::system::error_code error;
  const auto found =
      resolver.resolve(udp::v4(), options.host, std::to_string(options.udp_port), error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: {}", options.host, error.message()));
  }
  return found.begin()->endpoint();
}

asio::awaitable<std::optional<cnc::ads::Identity>> ask_identity(udp::endpoint controller) {
  Question question{.datagram = cnc::ads::identify_request(std::random_device{}()),
                    .to = {controller}};
  const auto answers = co_await ask(std::move(question));
  co_return answers.empty() ? std::nullopt : cnc::ads::identity_of(answers.front().second);
}

Answer answer_of(const std::optional<cnc::ads::Identity>& identity, std::uint16_t port) {
  const std::string what = fmt::format("UDP {} (discovery)", port);
  if (!identity) {
    return {what, "no response: `find` and `add-route --plain` need it", Verdict::optional};
  }
  std::string words = fmt::format("{}, NetId {}", identity->name, identity->net_id.to_string());
  for (const std::string& more : {identity->twincat.empty() ? "" : "TwinCAT " + identity->twincat,
                                  identity->system, identity->fingerprint}) {
    words += more.empty() ? "" : ", " + more;
  }
  return {what, words};
}

/// Whether a TCP port accepts connections; `advice` follows "open".
asio::awaitable<Answer> ask_port(std::string host, std::uint16_t port, std::string name,
                                 std::string advice) {
  constexpr std::chrono::milliseconds at_most{1000};
  const auto socket = co_await cnc::ads::dial(std::move(host), port, at_most);
  co_return Answer{fmt::format("TCP {} ({})", port, name), socket ? "open" + advice : "closed",
                   socket ? Verdict::there : Verdict::optional};
}

/// The name of the controller, made valid as a machine name.
std::string machine_name(const std::optional<cnc::ads::Identity>& identity) {
  std::string name = identity ? identity->name : "";
  std::ranges::transform(name, name.begin(), [](unsigned char c) {
    return c < 0x80 && std::isalnum(c) != 0 ? static_cast<char>(std::tolower(c)) : '_';
  });
  return gateway::settings::wrong_name(name).empty() ? name : "cnc";
}

/// The usual NetId: the address and .1.1.
std::string usual_net_id(const asio::ip::address& address) {
  return address.to_string() + ".1.1";
}

/// How a gateway would connect to it.
asio::awaitable<config::Machine> machine_of(const ProbeOptions& options,
                                            std::optional<cnc::ads::Identity> identity,
                                            udp::endpoint controller) {
  config::Machine machine;
  machine.set_name(machine_name(identity));
  machine.set_host(options.host);
  if (options.port != 0) {
    machine.set_port(options.port);
  }
  machine.set_net_id(!options.controller_net_id.empty() ? options.controller_net_id
                     : identity                         ? identity->net_id.to_string()
                                                        : usual_net_id(controller.address()));
  const auto executor = co_await asio::this_coro::executor;
  udp::socket socket(executor);
  socket.connect(controller);
  const std::string usual_source = usual_net_id(socket.local_endpoint().address());
  // A virtual CNC on this host has this one; then the default of the configuration.
  const std::string usual =
      usual_source == machine.net_id() ? machine.source_net_id() : usual_source;
  machine.set_source_net_id(options.net_id.empty() ? usual : options.net_id);
  if (!options.psk.empty()) {
    config::SecurePsk& psk = *machine.mutable_secure()->mutable_psk();
    psk.set_identity(options.psk);
    psk.set_password_file(fs::absolute(options.password_file));
  } else if (!options.self_signed.empty()) {
    const fs::path folder = fs::absolute(options.self_signed);
    const std::uint16_t port = options.port == 0 ? cnc::ads::secure_port : options.port;
    const cnc::ads::SelfSigned shown = certificate_and_key_in(folder);
    auto fingerprint = co_await agreed_fingerprint(options.host, port, options.fingerprint, shown);
    config::SecureSelfSigned& self_signed = *machine.mutable_secure()->mutable_self_signed();
    self_signed.set_certificate(certificate_in(folder));
    self_signed.set_key(key_in(folder));
    self_signed.set_fingerprint(fingerprint);
  } else if (!options.ca.empty()) {
    config::SecureSharedCa& shared = *machine.mutable_secure()->mutable_shared_ca();
    shared.set_ca(fs::absolute(options.ca));
    shared.set_certificate(fs::absolute(options.certificate));
    shared.set_key(fs::absolute(options.key));
    if (!options.common_name.empty()) {
      shared.set_common_name(options.common_name);
    }
  }
  co_return machine;
}

/// The responses over ADS itself.
asio::awaitable<void> ask_controller(MachineSettings machine, Report& report) {
  constexpr std::uint16_t system_service = 10000;
  const auto executor = co_await asio::this_coro::executor;
  cnc::ads::ClientOptions options = client_options(machine);
  auto client = std::make_unique<cnc::ads::Client>(executor, options);
  auto connected = co_await client->connect();
  if (!connected && connected.error().code == cnc::ads::ErrorCode::target_port_not_found) {
    // So the route exists, but no CNC. Which other services are there?
    options.probe_port = system_service;
    client = std::make_unique<cnc::ads::Client>(executor, options);
    const auto without_cnc = co_await client->connect();
    if (without_cnc) {
      connected = without_cnc;
    }
  }
  if (!connected) {
    report.answers.push_back({"route", connected.error().message, Verdict::missing});
    co_return;
  }
  report.answers.push_back({"route", fmt::format("requests of NetId {} are answered",
                                                 machine.controller.source.to_string())});
  auto found = co_await cnc::variables::probe(*client, machine.symbol);
  std::ranges::move(found.answers, std::back_inserter(report.answers));
  report.channels = found.channels;
  client->close();
}

asio::awaitable<Report> probe(ProbeOptions options) {
  Report report;
  const auto executor = co_await asio::this_coro::executor;
  const udp::endpoint controller = endpoint_of(options, executor);
  report.identity = co_await ask_identity(controller);
  const config::Machine block = co_await machine_of(options, report.identity, controller);
  report.block = block_of(block);
  const MachineSettings machine =
      gateway::settings::parse_settings(report.block, "gateway.textproto").machines.front();
  if (!options.json) {
    warn_of_the_one_connection(machine);
  }
  const bool secure = machine.controller.security.has_value();
  const std::uint16_t plain_port =
      secure ? MachineSettings().controller.tcp_port : machine.controller.tcp_port;
  const std::uint16_t secure_port = secure ? machine.controller.tcp_port : cnc::ads::secure_port;
  const std::string advice = secure ? "" : ": probe it with --psk, --self-signed or --ca";
  report.answers.push_back(answer_of(report.identity, options.udp_port));
  auto plain = co_await ask_port(options.host, plain_port, "plain ADS", "");
  report.answers.push_back(std::move(plain));
  auto tls = co_await ask_port(options.host, secure_port, "Secure ADS", advice);
  report.answers.push_back(std::move(tls));
  co_await ask_controller(machine, report);
  co_return report;
}

std::string_view word_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::there:
      return "ok";
    case Verdict::optional:
      return "absent";
    case Verdict::missing:
      return "missing";
  }
  return {};
}

void show(const ProbeOptions& options, const Report& report) {
  using base::text::to_utf8;
  if (options.json) {
    boost::json::array answers;
    for (const Answer& answer : report.answers) {
      answers.push_back({{"what", answer.what},
                         {"state", word_of(answer.verdict)},
                         {"answer", to_utf8(answer.answer)}});
    }
    print::print_json(boost::json::object{{"host", options.host},
                                          {"ready", report.ready()},
                                          {"channels", report.channels},
                                          {"answers", std::move(answers)},
                                          {"machine", report.block}});
    return;
  }
  print::Table table({{"STATE"}, {"WHAT"}, {"ANSWER"}});
  for (const Answer& answer : report.answers) {
    table.add({std::string(word_of(answer.verdict)), answer.what, to_utf8(answer.answer)});
  }
  fmt::print("{}\n{}\n\n{}", table.text(),
             report.ready() ? "A gateway can serve it. In gateway.textproto:"
                            : "A gateway cannot serve it yet. In gateway.textproto, once the "
                              "missing parts are there:",
             report.block);
}

int run_probe(const ProbeOptions& options) {
  check(options);
  asio::io_context io(1);
  std::future<Report> probed = asio::co_spawn(io, probe(options), asio::use_future);
  io.run();
  const Report report = probed.get();
  show(options, report);
  return report.ready() ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_probe(CLI::App& controller, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      controller, "probe",
      "Check what a controller offers to a gateway, and print its configuration",
      "millrace controller probe 192.168.10.5 --net-id 192.168.10.20.1.1\n"
      "  millrace controller probe 192.168.10.5 --net-id 192.168.10.20.1.1 --psk millrace "
      "--password-file press_1.psk");
  auto options = std::make_shared<ProbeOptions>();
  command.add_option("HOST", options->host, "Name or address of the controller")->required();
  command.add_option("--net-id", options->net_id,
                     "The NetId of the gateway; default: the address of this host and .1.1");
  command.add_option(
      "--controller-net-id", options->controller_net_id,
      "The NetId of the controller; default: as it reports over UDP, or its address and .1.1");
  command.add_option("--psk", options->psk,
                     "Over Secure ADS, with a pre-shared key: the identity of the key");
  command
      .add_option("--password-file", options->password_file,
                  "With --psk: file with the password in its first line")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  command
      .add_option("--self-signed", options->self_signed,
                  "Over Secure ADS, with millrace.key and millrace.crt in this folder, as "
                  "add-route makes them")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command.add_option(
      "--fingerprint", options->fingerprint,
      "With --self-signed: fingerprint of the controller's certificate; default: ask");
  command
      .add_option(
          "--ca", options->ca,
          "Over Secure ADS, with certificates of this CA; PEM, like --certificate and --key")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  command.add_option("--certificate", options->certificate, "With --ca: certificate of this host")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  command.add_option("--key", options->key, "With --ca: key of this host's certificate")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  command.add_option("--common-name", options->common_name,
                     "With --ca: common name in the controller's certificate; default HOST");
  command.add_option("--port", options->port,
                     "TCP port of the controller; default 48898, or 8016 for Secure ADS");
  command.add_option("--udp-port", options->udp_port, "UDP port of the controller")
      ->capture_default_str();
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, run_probe);
}

}  // namespace millrace::tools::commands::controller
