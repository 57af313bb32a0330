#include "gateway/machines/machine_status_writer.hpp"

#include <cmath>
#include <utility>

namespace millrace::gateway::machines {

void MachineStatusWriter::on_up(std::size_t channels, fabric::WatchMode watch,
                                const fabric::Message& note, Moment now) {
  if (!status_.connected) {
    status_.connected = true;
    status_.since = now.wall;
  }
  status_.watch = watch;
  status_.reason = note;
  status_.channels = static_cast<std::uint16_t>(channels);
}

void MachineStatusWriter::on_down(const fabric::Message& reason, Moment now,
                                  std::chrono::nanoseconds silent_for) {
  if (status_.connected || status_.since == fabric::Time{}) {
    status_.since = now.wall - silent_for;
  }
  status_.connected = false;
  status_.watch = fabric::WatchMode::none;
  status_.reason = reason;
  status_.channels = 0;
}

void MachineStatusWriter::on_load(const LinkLoad& load, SteadyTime now) {
  if (load.requests < load_.requests) {
    load_ = {};
  }
  if (load_at_ && now > *load_at_) {
    const std::chrono::duration<double> past = now - *load_at_;
    const auto requests = static_cast<double>(load.requests - load_.requests);
    status_.requests_per_second = static_cast<std::uint32_t>(std::lround(requests / past.count()));
    const auto answered = static_cast<std::int64_t>(load.answered - load_.answered);
    status_.round_trip =
        answered > 0 ? (load.waited - load_.waited) / answered : std::chrono::nanoseconds(0);
  }
  load_ = load;
  load_at_ = now;
}

void MachineStatusWriter::claim(fabric::Time since, std::vector<std::uint16_t> channels) {
  status_.claimed = since;
  status_.claims = std::move(channels);
}

std::optional<fabric::MachineStatus> MachineStatusWriter::take_change() {
  if (published_ == status_) {
    return std::nullopt;
  }
  published_ = status_;
  return published_;
}

}  // namespace millrace::gateway::machines
