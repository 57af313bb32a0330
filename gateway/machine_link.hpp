// The way to one controller: connects, finds its channels, carries reads and writes, and comes back
// after each failure by itself.
//
//   MachineLink link(executor, settings, events, log);
//   link.start();                                 → events.on_link_up("cnc", {1, 2})
//   link.read(1, Look::state);                    → events.on_read({"cnc", 1}, picture)
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "gateway/action.hpp"
#include "gateway/machine_report.hpp"
#include "gateway/settings.hpp"
#include "idl/program/log.hpp"

namespace millrace::gateway {

/// Called on the executor, never from within a function of the link.
class LinkEvents {
 public:
  virtual ~LinkEvents() = default;
  /// The controller answers and has a Service Interface in these channels.
  virtual void on_link_up(const std::string& machine,
                          const std::vector<std::uint16_t>& channels) = 0;
  /// Every read and write is answered before the link comes up again.
  virtual void on_link_down(const std::string& machine, const std::string& reason) = 0;
  virtual void on_read(const fabric::ChannelKey& key, const Picture& picture) = 0;
  /// `reason` is empty if the link is gone, which on_link_down explains.
  virtual void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) = 0;
  virtual void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                        const std::string& reason) = 0;
};

class MachineLink {
 public:
  MachineLink(boost::asio::any_io_executor executor, MachineSettings settings, LinkEvents& events,
              idl::program::Log log);
  /// Closes the connection; no event comes after it.
  ~MachineLink();
  MachineLink(const MachineLink&) = delete;
  MachineLink& operator=(const MachineLink&) = delete;

  void start();
  void read(std::uint16_t channel, Look look);
  void write(std::uint16_t channel, Variable variable, const Value& value);
  [[nodiscard]] LinkLoad load() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::gateway
