// Reads and writes the Service Interfaces of a controller's channels over its link, and reports the
// results.
//
//   interfaces.read(link, 1, ReadSet::state);    → events.on_read({"cnc", 1}, snapshot)
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include "cnc/ads/client.hpp"
#include "cnc/variables/service_interface.hpp"
#include "gateway/machines/controller.hpp"

namespace millrace::gateway::shell {

/// Part of a link: the caller passes a shared pointer to the link, which keeps the link alive until
/// the response.
class AdsServiceAccess {
 public:
  AdsServiceAccess(boost::asio::any_io_executor executor, std::string machine,
                   cnc::ads::Client& client, machines::ControllerEvents& events);

  /// Called before the channels of a new connection are used; nothing of an earlier connection is
  /// valid.
  void begin(const cnc::variables::Location& location);
  /// No event is reported from here on.
  void stop() { stopped_ = true; }

  /// Reads that are due in one turn of the loop share a request, as do those that come while four
  /// requests are on the wire.
  void read(const std::shared_ptr<void>& link, std::uint16_t channel, ReadSet set);
  void write(const std::shared_ptr<void>& link, std::uint16_t channel, Variable variable,
             const Value& value);

 private:
  using Reads = std::vector<std::pair<std::uint16_t, ReadSet>>;
  using Link = std::shared_ptr<void>;

  void send_reads(const Link& link);
  boost::asio::awaitable<void> read_together(Link link, Reads reads);
  boost::asio::awaitable<void> write_one(Link link, std::uint16_t channel, Variable variable,
                                         Value value);
  void read_failed(std::uint16_t channel, cnc::ads::ErrorCode code);

  boost::asio::any_io_executor executor_;
  std::string machine_;
  cnc::ads::Client& client_;
  machines::ControllerEvents& events_;
  cnc::variables::Location location_;
  cnc::variables::ServiceReads reads_;
  std::deque<std::pair<std::uint16_t, ReadSet>> due_;
  /// With reads, on the wire.
  std::size_t requests_ = 0;
  bool stopped_ = false;
};

}  // namespace millrace::gateway::shell
