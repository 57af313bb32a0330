// Ports of a core, which a test inspects; everything else is ignored.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/core/ports.hpp"
#include "gateway/machines/claims.hpp"
#include "tests/support/silent_link.hpp"

namespace millrace::gateway {

using namespace std::chrono_literals;
using tests::SilentLink;

inline constexpr std::uint64_t own_epoch = 1;
inline constexpr std::uint64_t other_epoch = 2;

inline fabric::InstanceId gateway_id(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

namespace core {

class RecordedPorts : public Fabric, public Host {
 public:
  void publish(const fabric::Request& request) override { given = request; }
  void publish(const fabric::Event&) override {}
  void publish(const fabric::ChannelStatus& status) override { channel = status; }
  void publish(const fabric::MachineStatus& status) override { machine_status = status; }
  void publish(const fabric::DataSample& sample) override { samples.push_back(sample); }
  void publish(const fabric::ProgramEvent& event) override { programs.push_back(event); }
  void publish(const fabric::InstanceId&, const fabric::VariableReply& reply) override {
    replies.push_back(reply);
  }
  void publish(const fabric::Outcome& outcome) override { outcomes.push_back(outcome); }
  void dispose(const fabric::RequestKey&) override {}
  void dispose(const fabric::ChannelKey&) override {}
  void dispose(const fabric::MachineStatus&) override {}
  void dispose(const fabric::DataSample& sample) override { disposed.push_back(sample.group); }
  [[nodiscard]] bool awaits_authentication() const override { return unauthenticated; }
  void subscribe_channels() override {}

  [[nodiscard]] Moment now() const override { return time; }
  void wake_at(std::optional<SteadyTime> at) override { wakes_at = at; }
  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings&) override {
    return nullptr;
  }
  void append(const JournalEntry&, const Ticket& ticket) override {
    if (ticket) {
      tickets.push_back(ticket);
    }
  }
  void log(Level, const std::string& text) override { log_lines.push_back(text); }
  void set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                 const fabric::Message&) override {
    alarms[key.kind] = text;
  }
  void may_end(bool half_written) override { ended = half_written; }

  Moment time{SteadyTime(std::chrono::hours(1)),
              machines::Claims::earliest + std::chrono::hours(1)};
  std::optional<SteadyTime> wakes_at;
  fabric::Request given;
  fabric::ChannelStatus channel;
  fabric::MachineStatus machine_status;
  std::vector<fabric::DataSample> samples;
  std::vector<std::string> disposed;
  std::vector<fabric::ProgramEvent> programs;
  std::vector<fabric::VariableReply> replies;
  std::vector<fabric::Outcome> outcomes;
  std::vector<Ticket> tickets;
  std::vector<std::string> log_lines;
  std::map<std::string, std::string> alarms;
  std::optional<bool> ended;
  bool unauthenticated = false;
};

}  // namespace core
}  // namespace millrace::gateway
