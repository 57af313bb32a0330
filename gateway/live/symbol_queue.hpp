// A message queue behind ADS symbols: an array, "SD.ALARMS", and a structure, "SD.CONTROL", with
// the members LastFilled and LastGet. That a controller has such symbols is our choice, for the
// virtual CNC.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "cnc/ads/client.hpp"
#include "cnc/variables/value.hpp"
#include "gateway/live/queue_port.hpp"
#include "gateway/queues/queue_settings.hpp"

namespace millrace::gateway::live {

/// For one link: what it has found out about the controller it does not ask again.
class SymbolQueue final : public QueuePort {
 public:
  SymbolQueue(std::shared_ptr<cnc::ads::Client> client, queues::QueueSettings settings)
      : client_(std::move(client)), settings_(std::move(settings)) {}

  Answer<queues::Control> read_control() override;
  Answer<std::vector<std::string>> read_queue() override;
  Answer<void> write_last_get(std::uint32_t element) override;
  boost::asio::awaitable<bool> watch(std::function<void()> told) override;

 private:
  /// Where something is.
  struct Place {
    cnc::ads::Index index;
    std::uint32_t size = 0;
    cnc::variables::ElementType type{};
  };
  struct Layout {
    Place array;
    Place control;
    Place last_filled;
    Place last_get;
    std::uint32_t elements = 0;
  };

  Answer<Place> find(std::string name, bool single);
  Answer<Layout> find_all();

  std::shared_ptr<cnc::ads::Client> client_;
  queues::QueueSettings settings_;
  std::optional<Layout> layout_;
};

}  // namespace millrace::gateway::live
