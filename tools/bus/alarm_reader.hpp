// Receives the alarms of processes.
//
//   AlarmReader alarms(participant, io.get_executor(), listener);
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/alarm.hpp"
#include "fabric/dds/participant.hpp"

namespace millrace::tools::bus {

/// Called on the executor, one at a time.
class AlarmListener {
 public:
  virtual ~AlarmListener() = default;
  /// The alarm was raised, or repeated.
  virtual void on_alarm(const fabric::Alarm& alarm) = 0;
  /// The alarm is over, or its process is gone.
  virtual void on_alarm_gone(const fabric::AlarmKey& key) = 0;
};

class AlarmReader {
 public:
  /// `participant` and `listener` outlive it. Throws std::runtime_error with Cyclone's reason.
  AlarmReader(const fabric::dds::Participant& participant,
              const boost::asio::any_io_executor& executor, AlarmListener& listener);
  ~AlarmReader();
  AlarmReader(const AlarmReader&) = delete;
  AlarmReader& operator=(const AlarmReader&) = delete;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::tools::bus
