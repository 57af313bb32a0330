#include "tools/commands/controller/controller.hpp"

#include <array>
#include <iostream>
#include <stdexcept>
#include <utility>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "base/loop/loop.hpp"
#include "base/messages/format.hpp"
#include "base/openssl/certificate.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/program/command_line.hpp"
#include "cnc/ads/secure_handshake.hpp"
#include "cnc/ads/stream.hpp"

namespace millrace::tools::commands::controller {

void add_controller(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "controller", "Find controllers, probe one, and add the route that it needs",
      "millrace controller find --interface eth0 --broadcast\n"
      "  millrace controller probe 192.168.10.5 --net-id 192.168.10.20.1.1\n"
      "  millrace controller add-route 192.168.10.5 --net-id 192.168.10.20.1.1 --user "
      "Administrator --self-signed /etc/millrace");
  command.require_subcommand(1);
  add_find(command, chosen);
  add_probe(command, chosen);
  add_route(command, chosen);
}

namespace asio = boost::asio;
using asio::ip::udp;
using base::loop::quietly;

asio::awaitable<std::vector<std::pair<std::string, cnc::ads::Datagram>>> ask(Question question) {
  std::vector<std::pair<std::string, cnc::ads::Datagram>> answers;
  // The timer's handler may come after this coroutine has ended.
  const auto socket = std::make_shared<udp::socket>(co_await asio::this_coro::executor,
                                                    udp::endpoint(question.from, 0));
  socket->set_option(asio::socket_base::broadcast(question.broadcast));
  const cnc::ads::Bytes bytes = cnc::ads::encode(question.datagram);
  for (const udp::endpoint& to : question.to) {
    const auto content = asio::buffer(bytes);
    const auto [error, size] = co_await socket->async_send_to(content, to, quietly);
    if (error) {
      throw std::runtime_error(fmt::format("cannot ask {}:{}: {}", to.address().to_string(),
                                           to.port(), error.message()));
    }
  }
  asio::steady_timer patience(socket->get_executor(), question.patience);
  patience.async_wait([socket](boost::system::error_code error) {
    if (!error) {
      boost::system::error_code ignored;
      socket->close(ignored);
    }
  });
  std::array<std::uint8_t, cnc::ads::max_datagram> room{};
  udp::endpoint peer;
  while (socket->is_open() && (question.broadcast || answers.size() < question.to.size())) {
    const auto buffer = asio::buffer(room);
    const auto [error, size] = co_await socket->async_receive_from(buffer, peer, quietly);
    const auto answer = cnc::ads::decode_datagram(cnc::ads::BytesView(room).first(size));
    if (!error && answer && answer->is_response &&
        answer->invoke_id == question.datagram.invoke_id) {
      answers.emplace_back(peer.address().to_string(), *answer);
    }
  }
  co_return answers;
}

namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  return base::posix::read_regular(file).value_or("");
}

}  // namespace

fs::path certificate_in(const fs::path& folder) {
  return folder / "millrace.crt";
}

fs::path key_in(const fs::path& folder) {
  return folder / "millrace.key";
}

cnc::ads::SelfSigned certificate_and_key_in(const fs::path& folder) {
  return {text_of(certificate_in(folder)), text_of(key_in(folder)), {}};
}

asio::awaitable<cnc::ads::Stream::Socket> secure_connection(std::string host, std::uint16_t port) {
  auto socket = co_await cnc::ads::dial(host, port, time_to_answer);
  if (!socket) {
    throw std::runtime_error(
        fmt::format("{}:{}: {}; Secure ADS needs TwinCAT 3.1 of build 4024 or later, and an open "
                    "TCP port 8016",
                    host, port, socket.error().text));
  }
  co_return std::move(*socket);
}

asio::awaitable<std::string> agreed_fingerprint(std::string host, std::uint16_t port,
                                                std::string given, cnc::ads::SelfSigned shown) {
  if (!given.empty()) {
    const auto fingerprint = base::openssl::parse_fingerprint(given);
    if (!fingerprint) {
      throw base::program::UsageError(
          fmt::format("--fingerprint {}: expected 32 bytes, as in AB:CD:…", given));
    }
    co_return *fingerprint;
  }
  auto socket = co_await secure_connection(host, port);
  const auto found =
      co_await cnc::ads::ask_fingerprint(std::move(socket), std::move(shown), time_to_answer);
  if (!found) {
    throw std::runtime_error(fmt::format("{}: {}", host, found.error()));
  }
  fmt::print(
      "The certificate of {} has the fingerprint\n  {}\n"
      "Compare it with what the controller shows (About TwinCAT). Is it the same? Type yes: ",
      host, *found);
  std::fflush(stdout);
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "yes") {
    throw std::runtime_error("the fingerprint was not confirmed");
  }
  co_return *found;
}

std::string block_of(const config::Machine& machine) {
  config::Gateway gateway;
  *gateway.add_machine() = machine;
  google::protobuf::TextFormat::Printer printer;
  printer.SetUseUtf8StringEscaping(true);
  std::string text;
  printer.PrintToString(gateway, &text);
  return text;
}

}  // namespace millrace::tools::commands::controller
