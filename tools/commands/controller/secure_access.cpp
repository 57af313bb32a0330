#include "tools/commands/controller/secure_access.hpp"

#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "base/openssl/certificate.hpp"
#include "base/program/command_line.hpp"
#include "cnc/ads/dial.hpp"
#include "cnc/ads/secure_handshake.hpp"

namespace millrace::tools::commands::controller {

namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
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
                    host, port, socket.error()));
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
