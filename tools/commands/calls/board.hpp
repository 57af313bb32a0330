// The table of `millrace calls -f` on a terminal: channels with their rates, and the last calls
// below. Pure.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>

#include "fabric/plant/plant.hpp"
#include "tools/recording/call.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::tools::commands::calls {

class Board {
 public:
  /// A call has ended, received at `now`.
  void add(const recording::Call& call, const recording::InstanceNames::Name& instance,
           fabric::Time now);

  /// At most `rows` lines of at most `columns` characters.
  [[nodiscard]] std::string text(const fabric::plant::Plant& live,
                                 const recording::CallFollower& follower, fabric::Time now,
                                 std::size_t rows, std::size_t columns) const;

 private:
  struct Channel {
    recording::Rate rate;
    std::string last_response;
  };

  [[nodiscard]] std::string table(const fabric::plant::Plant& live,
                                  const recording::CallFollower& follower, fabric::Time now) const;

  std::map<fabric::ChannelKey, Channel> channels_;
  /// The newest last.
  std::deque<std::string> lines_;
};

}  // namespace millrace::tools::commands::calls
