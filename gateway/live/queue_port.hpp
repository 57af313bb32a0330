// The way to a message queue in a controller. SymbolQueue reaches one by ADS symbols, as the
// virtual CNC has them; a Rexroth MTX, which is reached over OPC (its server has the item
// NC.SystemDataEvent for changes; documented, DOK-MTX***-NC*F*EX*V13, p. 655), needs an adapter of
// its own: this is where it goes (docs/queues.md).
//
//   auto control = co_await port.read_control();
//   auto texts = co_await port.read_queue();                  // all of the array, in one question
//   auto written = co_await port.write_last_get(3);
//
// Access from outside has a low priority in the controller and may come late (documented), so the
// control structure and the array are each fetched whole, with one question.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <tl/expected.hpp>

#include "gateway/queues/ring.hpp"

namespace millrace::gateway::live {

/// Errors are words that go behind the name of the queue. One question at a time.
class QueuePort {
 public:
  template <typename T>
  using Answer = boost::asio::awaitable<tl::expected<T, std::string>>;

  virtual ~QueuePort() = default;
  virtual Answer<queues::Control> read_control() = 0;
  /// The elements from the first to the last, as bytes in the controller's code page.
  virtual Answer<std::vector<std::string>> read_queue() = 0;
  virtual Answer<void> write_last_get(std::uint32_t element) = 0;
  /// Asks the controller to tell of changes of the control structure; `told` may come late, for
  /// nothing, or never. False if it tells of none: then it is looked at as its period says, which
  /// it is anyway.
  virtual boost::asio::awaitable<bool> watch(std::function<void()> told) = 0;
};

}  // namespace millrace::gateway::live
