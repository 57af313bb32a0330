// A controller that repeats the recorded requests: an ADS server with the Service Interface of each
// channel. The plan writes there what NC programs would write.
//
//   AsCnc stage(io.get_executor(), plan, channels, options, listener, log);   // listens from here
//   on …  until stage.unseen() is empty: a gateway looks at every channel stage.play(options);
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/device.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/program_control.hpp"
#include "cnc/simulator/virtual_device.hpp"
#include "cnc/variables/service_variable.hpp"
#include "tools/replay/player.hpp"
#include "tools/replay/to_services.hpp"

namespace millrace::tools::replay {

struct AsCncOptions {
  std::string address = "127.0.0.1";
  /// 0 = any free port.
  std::uint16_t tcp_port = 48898;
  cnc::ads::NetId net_id{{127, 0, 0, 1, 1, 1}};
};

class AsCnc : public Stage {
 public:
  /// `channels`: for each recorded channel the number of the channel that repeats its requests. All
  /// but `executor` and `options` outlive it. Throws std::runtime_error if it cannot listen.
  AsCnc(const boost::asio::any_io_executor& executor, const Plan& plan,
        const std::map<fabric::ChannelKey, std::uint32_t>& channels, const AsCncOptions& options,
        ReplayListener& listener, base::program::Log log);

  [[nodiscard]] std::uint16_t tcp_port() const { return server_.tcp_port(); }
  /// The channels that no gateway has read yet.
  [[nodiscard]] std::vector<std::uint32_t> unseen() const;

  /// Call it once.
  void play(const PlayOptions& options);
  [[nodiscard]] Player& player() { return *player_; }

  void issue(std::size_t call) override;
  void withdraw(std::size_t call, const fabric::Message& reason) override;
  void on_outcome(const Outcome& outcome) override { listener_.on_outcome(outcome); }
  /// Called after the gateway has the response to its last write.
  void on_done() override;

 private:
  /// Notes which channels are read.
  class Watched : public cnc::ads::ForwardingDevice {
   public:
    using ForwardingDevice::ForwardingDevice;
    cnc::ads::Result<cnc::ads::Bytes> read_write(std::uint16_t port, cnc::ads::Index index,
                                                 std::uint32_t read_length,
                                                 cnc::ads::BytesView data) override;
    std::set<std::uint32_t> seen;
  };

  /// Channels of this controller run no programs.
  class NoPrograms : public cnc::simulator::ProgramSource {
    tl::expected<cnc::simulator::Program, std::string> load(std::string_view name) override;
  };

  /// A call that is pending in a channel.
  struct Open {
    std::size_t call = 0;
    /// RESPONSE was written since the request.
    bool has_text = false;
  };

  void answer_written(std::uint32_t channel, cnc::variables::ServiceVariable which);
  [[nodiscard]] cnc::simulator::Variable& variable(std::uint32_t channel,
                                                   cnc::variables::ServiceVariable which);

  boost::asio::any_io_executor executor_;
  const Plan& plan_;
  const std::map<fabric::ChannelKey, std::uint32_t>& channels_;
  ReplayListener& listener_;
  NoPrograms programs_;
  cnc::simulator::Machine machine_;
  cnc::simulator::VirtualDevice device_;
  Watched watched_{device_};
  cnc::ads::SumCommands with_sums_{watched_};
  std::map<std::uint32_t, Open> open_;
  std::optional<Player> player_;
  cnc::ads::Server server_;
};

}  // namespace millrace::tools::replay
