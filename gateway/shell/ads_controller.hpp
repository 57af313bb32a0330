// The connection to one controller: connects, finds its channels, carries reads and writes, and
// reconnects by itself after each failure.
//
//   AdsController link(executor, settings, events, log);
//   link.start();                                 → events.on_link_up("cnc", {1, 2})
//   link.read(1, ReadSet::state);                    → events.on_read({"cnc", 1}, snapshot)
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/readings.hpp"
#include "gateway/machines/controller.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::shell {

/// Calls `events` on the executor.
class AdsController final : public machines::Controller {
 public:
  AdsController(boost::asio::any_io_executor executor, settings::MachineSettings settings,
                machines::ControllerEvents& events, base::program::Log log);
  ~AdsController() override;
  AdsController(const AdsController&) = delete;
  AdsController& operator=(const AdsController&) = delete;

  void start();
  void read(std::uint16_t channel, ReadSet set) override;
  void write(std::uint16_t channel, Variable variable, const Value& value) override;
  void subscribe(const std::vector<std::uint16_t>& channels) override;
  void unsubscribe(const std::vector<std::uint16_t>& channels) override;
  void ask(const machines::Question& question) override;
  void open(const fabric::ChannelKey& queue, const queues::QueueSettings& settings) override;
  void ask(const fabric::ChannelKey& queue, const queues::Step& step) override;
  void subscribe(const fabric::ChannelKey& queue) override;
  [[nodiscard]] machines::LinkLoad load() const override;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

// Sends the core's value requests to a controller.

/// An open connection for value requests: it stores what was found out about the controller for the
/// next request.
struct ValueSource {
  ValueSource(cnc::ads::Client& the_client, cnc::variables::Location the_location)
      : client(the_client), location(the_location), readings(client, location) {}
  cnc::ads::Client& client;
  cnc::variables::Location location;
  cnc::variables::Readings readings;
};

/// One request of a source at a time; its client must outlive it.
boost::asio::awaitable<machines::Answer> ask_values(std::shared_ptr<ValueSource> source,
                                                    machines::Question question);

}  // namespace millrace::gateway::shell
