// Sends recorded requests to live services, in channels that belong to no machine.
//
//   ToServices stage(participant, io.get_executor(), slot, plan, channels, listener);
//   …  until stage.missing() is empty
//   stage.play(options);
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/caller/caller.hpp"
#include "tools/replay/player.hpp"

namespace millrace::tools::replay {

/// Called on the executor, one at a time.
class ReplayListener {
 public:
  virtual ~ReplayListener() = default;
  virtual void on_outcome(const Outcome& outcome) = 0;
  virtual void on_done() = 0;
};

/// The channel that stands for a recorded one on the fabric.
struct ReplayChannel {
  fabric::ChannelKey key{};
  /// The channel that scopes of instances are compared with.
  fabric::ChannelKey as{};
};
using ReplayChannels = std::map<fabric::ChannelKey, ReplayChannel>;

class ToServices : public Stage, public caller::CallerListener {
 public:
  /// `channels` has every channel of the plan. All but `executor` outlive this object.
  ToServices(fabric::dds::Participant& participant, const boost::asio::any_io_executor& executor,
             const caller::Slot& slot, const Plan& plan, const ReplayChannels& channels,
             ReplayListener& listener);

  /// One line for each service of the plan that is not there yet; empty once all are.
  [[nodiscard]] std::vector<std::string> missing() const;

  /// Call it once.
  void play(const PlayOptions& options);
  [[nodiscard]] Player& player() { return *player_; }

  void issue(std::size_t call) override;
  void withdraw(std::size_t call, const fabric::Message& reason) override;
  void on_outcome(const Outcome& outcome) override { listener_.on_outcome(outcome); }
  void on_done() override { listener_.on_done(); }
  void on_ended(const caller::Ended& ended) override;

 private:
  boost::asio::any_io_executor executor_;
  const Plan& plan_;
  const ReplayChannels& channels_;
  ReplayListener& listener_;
  std::map<fabric::CallId, std::size_t> open_;
  std::map<std::size_t, fabric::CallId> ids_;
  std::optional<Player> player_;
  caller::Caller caller_;
};

/// The services that a plan needs: UUID as the program wrote it, and the recorded channel.
std::set<std::pair<std::string, fabric::ChannelKey>> needs_of(const Plan& plan);

}  // namespace millrace::tools::replay
