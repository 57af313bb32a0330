// The processes of the whole chain for a test: on free ports, in their own DDS domain.
//
//   Chain chain;
//   Process service = chain.square_root();
//   Process cnc = chain.cnc({"--run", chain.program(1, "square_root_of_3.nc"), …});
//   Process gateway = chain.gateway();
//   cnc.await("response = 1.732051");
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/trust_credentials.hpp"

namespace millrace::tests::integration {

using Flags = std::vector<std::string>;

class Chain {
 public:
  /// From now on a gateway continues the journal of the gateway before it.
  void keep_state() { state_home_ = folder_.path() / "state"; }
  /// From now on the fabric has trust, with credentials for services of these UUIDs.
  void with_trust(const std::vector<std::string>& uuids, const std::string& protection = "SIGN");
  [[nodiscard]] const TrustCredentials& trust() const { return trust_.value(); }

  /// Starts a virtual CNC, with two channels unless the flags differ, and waits until it is ready;
  /// gateways started later serve it.
  Process cnc(const Flags& flags = {});
  /// Starts a gateway for the last virtual CNC and waits until it is ready.
  Process gateway(const Flags& flags = {});
  /// A gateway with this configuration, in which @PORT@ is the port of the last virtual CNC.
  Process configured_gateway(const std::string& configuration, const Flags& flags = {});
  /// Changes the configuration of such a gateway.
  void configure(std::string configuration);
  /// Starts a square root service and waits until it is ready.
  Process square_root(const Flags& flags = {});

  /// Replays a recording in place of the virtual CNC; gateways started later serve it.
  Process stand_in(const Flags& flags);

  /// The operator's command, on this domain where it uses one.
  [[nodiscard]] Process millrace(Flags command) const;
  /// The same as a command line, for a test that starts it itself.
  [[nodiscard]] Flags command(Flags command) const;

  /// A service that answers with its request after a while; `record` is the file in which it lists
  /// its executions.
  Process slow_service(const Flags& flags = {});
  [[nodiscard]] std::filesystem::path record() const { return folder_.path() / "executions"; }
  [[nodiscard]] std::filesystem::path configuration() const {
    return folder_.path() / "gateway.textproto";
  }

  [[nodiscard]] std::uint32_t domain() const { return domain_.number(); }
  /// The port of the last virtual CNC.
  [[nodiscard]] std::uint16_t port() const { return static_cast<std::uint16_t>(std::stoi(port_)); }
  /// Gateways started from now on expect the machine at this port.
  void serve_at(std::uint16_t port) { port_ = std::to_string(port); }

  /// "CHANNEL=FILE" for --run, FILE from tests/data/nc/chain.
  [[nodiscard]] static std::string program(int channel, const std::string& file);
  /// The path of a program that makes `calls` calls, each with its number, and checks that each
  /// answer is that number; at its end it prints "N calls answered".
  [[nodiscard]] std::string counting_program(const std::string& uuid, std::uint32_t calls) const;
  /// A folder for this test.
  [[nodiscard]] std::filesystem::path folder() const { return folder_.path(); }

 private:
  Process start(const std::string& name, Flags command);
  /// The flags with which a program of this name joins the fabric.
  [[nodiscard]] Flags joining(const std::string& name) const;

  Domain domain_;
  TemporaryFolder folder_;
  /// Empty: each process has one of its own.
  std::filesystem::path state_home_;
  std::optional<TrustCredentials> trust_;
  std::string port_;
};

/// A test of subcommands.
class ChainTest : public testing::Test {
 protected:
  /// Runs `millrace ARGS` to its end.
  Process run(Flags args) {
    Process process = chain.millrace(std::move(args));
    exit_code = process.wait();
    return process;
  }
  static std::size_t lines_with(const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
      ++count;
    }
    return count;
  }

  Chain chain;
  int exit_code = -1;
};

}  // namespace millrace::tests::integration
