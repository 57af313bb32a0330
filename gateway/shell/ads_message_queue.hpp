// A message queue behind ADS symbols: an array, "SD.ALARMS", and a structure, "SD.CONTROL", with
// the members LastFilled and LastGet. That a controller has such symbols is our choice, for the
// virtual CNC. A Rexroth MTX is reached over OPC (its server has the item NC.SystemDataEvent for
// changes; documented, DOK-MTX***-NC*F*EX*V13, p. 655) and needs a class of its own beside this
// one (docs/dev/decisions/queues.md).
//
//   auto control = co_await queue.ask(queues::ReadControl{});
//   auto texts = co_await queue.ask(queues::ReadQueue{});         // all of the array at once
//
// Access from outside has a low priority in the controller and may come late (documented), so the
// control structure and the array are each fetched whole, with one question.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "cnc/ads/client.hpp"
#include "cnc/variables/value.hpp"
#include "gateway/queues/queue_reader.hpp"
#include "gateway/queues/queue_settings.hpp"

namespace millrace::gateway::shell {

/// For one link: it requests the layout from the controller once. Errors are phrases that follow
/// the name of the queue. One request at a time.
class AdsMessageQueue {
 public:
  /// `client` must outlive all requests.
  AdsMessageQueue(cnc::ads::Client& client, queues::QueueSettings settings)
      : client_(client), settings_(std::move(settings)) {}

  boost::asio::awaitable<queues::StepAnswer> ask(queues::Step step);
  /// Requests notifications of the control structure; `on_event` may be called late, for nothing,
  /// or never. False if the controller refuses: the queue is polled in any case.
  boost::asio::awaitable<bool> watch(std::function<void()> on_event);

 private:
  /// Index group, index offset and size of a variable.
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

  template <typename T>
  using Found = boost::asio::awaitable<queues::Answer<T>>;

  Found<queues::Control> read_control();
  /// The elements from the first to the last, as bytes in the controller's code page.
  Found<std::vector<std::string>> read_queue();
  Found<void> write_last_get(std::uint32_t element);
  Found<Place> find(std::string name, bool single);
  Found<Layout> find_all();

  cnc::ads::Client& client_;
  queues::QueueSettings settings_;
  std::optional<Layout> layout_;
};

}  // namespace millrace::gateway::shell
