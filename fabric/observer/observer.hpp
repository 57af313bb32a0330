// Watches a fabric without taking part: everything on its topics, and who is there, as entries.
//
//   Observer observer(participant, io.get_executor(), listener, Interest::everything);
//   …  listener.on_entry(entry)
//
// Its readers keep everything until it is taken, so nothing is lost here while the executor is
// busy; the writers keep their last samples only and never wait.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/observer/entry.hpp"

namespace millrace::fabric::observer {

/// Called on the executor, one at a time.
class ObserverListener {
 public:
  virtual ~ObserverListener() = default;
  virtual void on_entry(Entry entry) = 0;
  /// What a participant said is not an entry, since it is not its to say; once a minute of each.
  virtual void on_ignored(const std::string& reason) { static_cast<void>(reason); }
};

enum class Interest : std::uint8_t {
  /// Instances, channels, machines, NC programs, alarms: what changes a few times a second, and who
  /// is there.
  states,
  /// Events of calls and states of channels: what becomes of calls.
  calls,
  /// Values of machines and what becomes of programs.
  data,
  alarms,
  /// What the others see, and requests, replies, commands and outcomes.
  everything
};

/// What the bus delivered.
struct Counts {
  std::uint64_t delivered = 0;
  /// Of them longer than any sample of a millrace process; the rest was cut off.
  std::uint64_t shortened = 0;
  /// Gone before they arrived: overwritten by their writer, or dropped.
  std::uint64_t lost = 0;
};

class Observer {
 public:
  /// `participant` and `listener` outlive the observer. Throws std::runtime_error with Cyclone's
  /// reason.
  Observer(dds::Participant& participant, const boost::asio::any_io_executor& executor,
           ObserverListener& listener, Interest interest);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Hands out what has arrived and was not yet handed out, without waiting; true if it was much
  /// and there may be more.
  bool drain();
  [[nodiscard]] Counts counts() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::observer
