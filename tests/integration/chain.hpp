// The programs of the whole chain as a test starts them: on free ports, in a DDS domain of their
// own.
//
//   Chain chain;
//   Process service = chain.square_root();
//   Process cnc = chain.cnc({"--run", chain.program(1, "square_root_of_3.nc"),
//   "--exit-when-idle"}); Process gateway = chain.gateway(); cnc.await("response = 1.732051");
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/trust_credentials.hpp"

namespace millrace::tests::integration {

using Flags = std::vector<std::string>;

class Chain {
 public:
  /// From now on each program shows what it is, made for services of these UUIDs.
  void with_trust(const std::vector<std::string>& uuids, const std::string& protection = "SIGN");
  [[nodiscard]] const TrustCredentials& trust() const { return trust_.value(); }

  /// A virtual CNC with two channels unless the flags say otherwise, ready; the gateways started
  /// after it serve this one.
  Process cnc(const Flags& flags = {});
  /// A gateway of the last virtual CNC, ready.
  Process gateway(const Flags& flags = {});
  /// A gateway with this configuration, in which @PORT@ is the port of the last virtual CNC.
  Process configured_gateway(const std::string& configuration, const Flags& flags = {});
  /// Changes the configuration that such a gateway reads.
  void configure(std::string configuration);
  /// A square root service, ready.
  Process square_root(const Flags& flags = {});

  /// A recording in the place of the virtual CNC, ready; the gateways started after it serve this
  /// one.
  Process stand_in(const Flags& flags);

  /// The operator's command, on this domain where it uses one.
  [[nodiscard]] Process millrace(Flags command) const;
  /// The same as a command line, for a test that starts it itself.
  [[nodiscard]] Flags command(Flags command) const;

  /// A service that answers with its request, after a while; `record` collects what it ran.
  Process slow_service(const Flags& flags = {});
  [[nodiscard]] std::filesystem::path record() const { return folder_.path() / "executions"; }
  [[nodiscard]] std::filesystem::path configuration() const {
    return folder_.path() / "gateway.textproto";
  }

  [[nodiscard]] std::uint32_t domain() const { return domain_.number(); }
  /// Of the last virtual CNC.
  [[nodiscard]] std::uint16_t port() const { return static_cast<std::uint16_t>(std::stoi(port_)); }
  /// The gateways started from now on find the machine here.
  void serve_at(std::uint16_t port) { port_ = std::to_string(port); }

  /// "CHANNEL=FILE" for --run, FILE from tests/data/nc/chain.
  [[nodiscard]] static std::string program(int channel, const std::string& file);
  /// The path of a program that makes so many calls, each with its number, and looks whether each
  /// answer is that number; at its end it says "N calls answered".
  [[nodiscard]] std::string counting_program(const std::string& uuid, std::uint32_t calls) const;
  /// A folder of this test's own.
  [[nodiscard]] std::filesystem::path folder() const { return folder_.path(); }

 private:
  Process start(const std::string& name, Flags command);
  /// How a program of this name joins the fabric.
  [[nodiscard]] Flags joining(const std::string& name) const;

  Domain domain_;
  TemporaryFolder folder_;
  std::optional<TrustCredentials> trust_;
  std::string port_;
};

}  // namespace millrace::tests::integration
