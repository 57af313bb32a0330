// A controller in place of the virtual CNC: one channel behind an ADS server, which acknowledges
// writes and applies them later, and may clear REQUEST_STATE itself. Its program sends its next
// request in the cycle in which it finds its answer.
//
//   LateController sut(executor, {.response_after = 5ms, …}, {.requests = 20});
//   … machine { port: sut.port() … }
//   sut.answers();                                     // as the program has read them
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <boost/asio/steady_timer.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/support/service_interface.hpp"

namespace millrace::tests::failures {

struct LateProgram {
  std::string uuid;
  /// The text of each is its number, from 1.
  std::uint32_t requests = 20;
  /// REQUEST_STATE goes 1, 2, 3, 1 …; otherwise it is always 1.
  bool changing_states = false;
};

/// Everything runs on the one executor.
class LateController final : private cnc::ads::Device {
 public:
  LateController(const boost::asio::any_io_executor& executor, KernelRules rules,
                 LateProgram program, bool notifies, const base::program::Log& log);

  [[nodiscard]] std::uint16_t port() const { return server_.tcp_port(); }
  [[nodiscard]] const std::vector<std::string>& answers() const { return answers_; }
  [[nodiscard]] bool done() const { return answers_.size() == program_.requests; }

 private:
  [[nodiscard]] bool has_port(std::uint16_t port) const override;
  cnc::ads::Result<cnc::ads::DeviceInfo> info(std::uint16_t port) override;
  cnc::ads::Result<cnc::ads::DeviceState> state(std::uint16_t port) override;
  cnc::ads::Result<void> write_control(std::uint16_t port, cnc::ads::DeviceState wanted,
                                       cnc::ads::BytesView data) override;
  cnc::ads::Result<cnc::ads::Bytes> read(std::uint16_t port, cnc::ads::Index index,
                                         std::uint32_t length) override;
  cnc::ads::Result<void> write(std::uint16_t port, cnc::ads::Index index,
                               cnc::ads::BytesView data) override;
  cnc::ads::Result<cnc::ads::Bytes> read_write(std::uint16_t port, cnc::ads::Index index,
                                               std::uint32_t length,
                                               cnc::ads::BytesView data) override;
  [[nodiscard]] cnc::ads::Bytes value_of(gateway::Variable variable);
  void ask();
  void run();

  LateProgram program_;
  bool notifies_;
  ServiceInterface channel_;
  std::vector<std::string> answers_;
  boost::asio::steady_timer cycle_;
  cnc::ads::SumCommands with_sums_{*this};
  cnc::ads::Server server_;
};

}  // namespace millrace::tests::failures
