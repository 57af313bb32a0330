// A virtual CNC on its host: the machine with its ADS server, its cycle and its operator's panel.
//
//   Station station(io.get_executor(), setup, panel, log);    // listens from here on
//   station.on_idle([&] { io.stop(); });
//   station.start(runs, programs);
//   io.run();
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/discovery_server.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/simulator/cycle.hpp"
#include "cnc/simulator/host_files.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/symbol_names.hpp"
#include "cnc/simulator/options.hpp"
#include "cnc/simulator/panel.hpp"
#include "cnc/simulator/virtual_device.hpp"

namespace millrace::cnc::simulator {

class Station {
 public:
  /// The panel must outlive the station. Throws std::runtime_error if it cannot listen.
  Station(const boost::asio::any_io_executor& executor, const Setup& setup, Panel& panel,
          const base::program::Log& log);
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// TCP ports of plain and of Secure ADS; nullopt if not served.
  [[nodiscard]] std::optional<std::uint16_t> plain_port() const { return port_of(plain_); }
  [[nodiscard]] std::optional<std::uint16_t> secure_port() const { return port_of(secure_); }
  /// UDP port.
  [[nodiscard]] std::optional<std::uint16_t> discovery_port() const {
    return discovery_ ? std::optional(discovery_->port()) : std::nullopt;
  }
  [[nodiscard]] bool active() const { return machine_.active(); }
  [[nodiscard]] const CycleCounts& cycles() const { return cycle_.counts(); }
  /// Sets the handler that is called after each cycle without an active NC program: when the last
  /// one has ended, and after a command that starts none.
  void on_idle(std::function<void()> handler) { on_idle_ = std::move(handler); }
  /// Calls `done` once clients have the responses to all their requests so far, or after one
  /// second: a client may not read them.
  void drain(std::function<void()> done);
  /// Starts each program in the channel of the run with the same index; the panel shows the
  /// mistakes of those that cannot be started.
  void start(const std::vector<Run>& runs, const std::vector<Program>& programs);

 private:
  /// The device with its symbols, if it has any.
  ads::Device& named_device(const Settings& settings);
  ads::Device& served_device(const Settings& settings);
  static std::optional<std::uint16_t> port_of(const std::optional<ads::Server>& server) {
    return server ? std::optional(server->tcp_port()) : std::nullopt;
  }
  /// Runs one cycle; true while more are needed.
  bool advance(std::chrono::nanoseconds now);

  Panel& panel_;
  base::program::Log log_;
  std::function<void()> on_idle_ = [] {};
  ProgramFolders folders_;
  Machine machine_;
  VirtualDevice device_;
  objects::SymbolNames symbol_names_;
  ads::Symbols with_symbols_;
  ads::SumCommands with_sums_;
  std::optional<ads::Server> plain_;
  std::optional<ads::Server> secure_;
  std::optional<ads::DiscoveryServer> discovery_;
  Cycle cycle_;
};

}  // namespace millrace::cnc::simulator
