// The values from a receiver on a serial line, channel by channel, and the gauges that read them.
//
//   Receiver receiver(Form::u_wave, Unit::mm);
//   receiver.opened();
//   receiver.hear("DT10002-0000000.001M\r", now);
//   RadioSource(receiver, 2).read(now)->value == -1'000
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/dial_gauge/frame.hpp"
#include "services/dial_gauge/source.hpp"

namespace millrace::services::dial_gauge {

/// Pure: the caller passes the events of the line. Not thread-safe.
class Receiver {
 public:
  Receiver(Form form, Unit digimatic_unit) : frames_(form, digimatic_unit) {}

  void opened();
  /// The line is closed, with the reason as text. Earlier values stay, and get older.
  void closed(std::string reason);
  /// Handles bytes of the line. Returns the text of each broken frame, for the log.
  std::vector<std::string> hear(std::string_view bytes, Time now);

  [[nodiscard]] tl::expected<Reading, Failure> newest(unsigned channel) const;
  [[nodiscard]] Condition condition(unsigned channel) const;

 private:
  struct Channel {
    std::optional<Reading> newest;
    /// The last error code of the receiver, if no value came since.
    std::optional<char> error;
    std::uint64_t values = 0;
    std::uint64_t errors = 0;
  };

  FrameReader frames_;
  /// Why the line is down; nullopt while it is up.
  std::optional<std::string> down_ = "not opened yet";
  std::map<unsigned, Channel> channels_;
};

class RadioSource : public Source {
 public:
  RadioSource(std::shared_ptr<const Receiver> receiver, unsigned channel)
      : receiver_(std::move(receiver)), channel_(channel) {}
  tl::expected<Reading, Failure> read(Time /*now*/) override { return receiver_->newest(channel_); }
  [[nodiscard]] Condition condition() const override { return receiver_->condition(channel_); }
  [[nodiscard]] bool has_reading() const override {
    return receiver_->newest(channel_).has_value();
  }

 private:
  std::shared_ptr<const Receiver> receiver_;
  unsigned channel_;
};

}  // namespace millrace::services::dial_gauge
