// A plant on the fabric without machines: a gateway's side of 20 machines with 10 channels each,
// which calls one service at a steady rate and publishes machine data.
//
//   BusyPlant plant(domain, 1);
//   const Histogram times = plant.run(10, 1000);
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/data_endpoint.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::bench {

using Clock = std::chrono::steady_clock;
using tools::recording::Histogram;

inline constexpr std::uint16_t machines_with_data = 4;
/// Of one channel of each of them.
inline constexpr int variables = 100;

/// Machines are numbered from 1; the first ones have data.
std::string name_of_machine(std::uint16_t machine);

inline fabric::Time now() {
  return std::chrono::system_clock::now();
}

class BusyPlant : public fabric::endpoints::CallEndpointListener {
 public:
  BusyPlant(std::uint32_t domain, std::uint64_t epoch);

  /// The times of the calls, from the request to its reply. Throws if there is no service.
  Histogram run(double seconds, double calls_per_second);

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    instance_ = instance.id;
  }
  void on_instance_changed(const fabric::InstanceIdentity&) override {}
  void on_instance_gone(const fabric::InstanceId&) override {}
  void on_reply(const fabric::Reply& reply) override;

 private:
  struct Open {
    fabric::Request request;
    Clock::time_point begun;
  };

  void tell_machines();
  /// Publishes data in which every value has changed, and that it runs.
  void tell_data();
  /// Calls in one channel after the other.
  void keep_going();
  void call(const fabric::ChannelKey& key);
  void tell(const fabric::ChannelKey& key, fabric::ChannelState state, fabric::CallId call = {});

  template <typename Sample>
  void publish(const Sample& sample) {
    if (const auto published = end_.publish(sample); !published) {
      throw std::runtime_error(published.error());
    }
  }

  std::uint64_t epoch_;
  fabric::Time claimed_ = now();
  std::uint64_t number_ = 0;
  std::uint64_t sent_ = 0;
  double calls_per_second_ = 0;
  fabric::InstanceId gateway_ = fabric::InstanceId::random();
  boost::asio::io_context io_;
  boost::asio::steady_timer tick_;
  std::deque<fabric::ChannelKey> free_;
  std::optional<fabric::InstanceId> instance_;
  std::map<fabric::ChannelKey, Open> open_;
  Histogram times_;
  Clock::time_point begun_{};
  Clock::time_point stop_at_{};
  fabric::dds::Participant participant_;
  fabric::endpoints::CallEndpoint end_;
  fabric::endpoints::DataEndpoint data_;
  boost::asio::steady_timer beat_;
  double beats_ = 0;
};

}  // namespace millrace::bench
