// The way to one controller: connects, finds its channels, carries reads and writes, and comes back
// after each failure by itself.
//
//   MachineLink link(executor, settings, events, log);
//   link.start();                                 → events.on_link_up("cnc", {1, 2})
//   link.read(1, Look::state);                    → events.on_read({"cnc", 1}, picture)
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "gateway/link.hpp"
#include "gateway/settings.hpp"
#include "idl/program/log.hpp"

namespace millrace::gateway {

/// Calls `events` on the executor.
class MachineLink final : public Link {
 public:
  MachineLink(boost::asio::any_io_executor executor, MachineSettings settings, LinkEvents& events,
              idl::program::Log log);
  ~MachineLink() override;
  MachineLink(const MachineLink&) = delete;
  MachineLink& operator=(const MachineLink&) = delete;

  void start();
  void read(std::uint16_t channel, Look look) override;
  void write(std::uint16_t channel, Variable variable, const Value& value) override;
  [[nodiscard]] LinkLoad load() const override;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::gateway
