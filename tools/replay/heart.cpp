#include "tools/replay/heart.hpp"

#include <algorithm>
#include <utility>

namespace millrace::tools::replay {

Heart::Heart(const fabric::dds::Participant& participant,
             const boost::asio::any_io_executor& executor, Loads loads)
    : period_(std::chrono::nanoseconds(participant.options().lease) /
              fabric::ends::BeatEnd::beats_per_lease),
      loads_(std::move(loads)),
      end_(participant),
      timer_(executor, std::chrono::steady_clock::now()) {
  beat();
}

void Heart::beat() {
  for (const fabric::InstanceLoad& load : loads_()) {
    beats_.note(load);
  }
  // A beat that is lost is followed by the next one.
  static_cast<void>(end_.publish(beats_.next(std::chrono::system_clock::now())));
  // Late ones are not made up for.
  timer_.expires_at(std::max(timer_.expiry() + period_, std::chrono::steady_clock::now()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      beat();
    }
  });
}

}  // namespace millrace::tools::replay
