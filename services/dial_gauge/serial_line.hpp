// A serial line that is kept open: reports its bytes, and when it opens and closes.
//
//   SerialLine line(context.get_executor(), {.device = "/dev/ttyUSB0", .baud_rate = 57600},
//                   listener);
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <boost/asio/any_io_executor.hpp>

#include "services/dial_gauge/config.hpp"

namespace millrace::services::dial_gauge {

/// Called on the executor of the line.
class SerialLineListener {
 public:
  virtual ~SerialLineListener() = default;
  virtual void on_opened() = 0;
  /// `reason` as text, with the device. Called once for each loss, not for each failed attempt to
  /// open the device.
  virtual void on_closed(const std::string& reason) = 0;
  virtual void on_bytes(std::string_view bytes) = 0;
};

/// Opens the device at once, and again `reopen` after each failure. Destroy it on the executor or
/// after its context has stopped.
class SerialLine {
 public:
  SerialLine(const boost::asio::any_io_executor& executor, LineConfig config,
             SerialLineListener& listener);
  ~SerialLine();
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

 private:
  class Session;
  std::shared_ptr<Session> session_;
};

}  // namespace millrace::services::dial_gauge
