// The machines of a gateway without a controller: each link is up at once and answers nothing.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/core/machines.hpp"
#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway {

using machines::Channels;

/// Of a link that is up at once and answers nothing.
class NoLink final : public SilentLink {
 public:
  using SilentLink::ask;
  using SilentLink::subscribe;
  NoLink(std::vector<Channels>& watched, std::vector<Channels>& unwatched, int& questions)
      : watched_(watched), unwatched_(unwatched), questions_(questions) {}
  void ask(const machines::Question&) override { ++questions_; }
  void subscribe(const Channels& channels) override { watched_.push_back(channels); }
  void unsubscribe(const Channels& channels) override { unwatched_.push_back(channels); }

 private:
  std::vector<Channels>& watched_;
  std::vector<Channels>& unwatched_;
  int& questions_;
};

/// With links that are up at once.
class MachinePorts final : public core::RecordedPorts {
 public:
  using RecordedPorts::dispose;
  using RecordedPorts::publish;
  void dispose(const fabric::MachineStatus& status) override { given_up.push_back(status); }
  void publish(const fabric::MachineStatus& status) override {
    published = status;
    ++times_published;
  }
  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings&) override {
    linked = true;
    return std::make_unique<NoLink>(watched, unwatched, questions);
  }

  bool linked = false;
  fabric::MachineStatus published;
  int times_published = 0;
  std::vector<fabric::MachineStatus> given_up;
  std::vector<Channels> watched;
  std::vector<Channels> unwatched;
  /// For values.
  int questions = 0;
};

class MachinesTest : public testing::Test, public core::MachinesListener {
 protected:
  MachinesTest() {
    settings::MachineSettings machine;
    machine.name = "cnc";
    sut.set({machine}, time);
  }

  // MachinesListener.
  void on_serve(const std::string&, const Channels& channels) override {
    EXPECT_TRUE(linked);
    served = channels;
  }
  void on_lost(const std::string&, const fabric::Message&) override {}
  void on_link_dropped(const std::string&, const fabric::Message&) override { linked = false; }
  void on_channel_removed(const fabric::ChannelKey&) override {}
  void on_not_owner(const fabric::ChannelKey&, const fabric::Message&) override {}
  void on_predecessor_call(const fabric::ChannelStatus& status, const std::string& from) override {
    predecessor_calls.emplace_back(status.key.channel, from);
  }
  [[nodiscard]] Channels channels_of(const std::string&) const override { return served; }
  void on_trusted(const fabric::ChannelKey& key, bool is) override { trusted[key.channel] = is; }
  void on_change(const fabric::ChannelKey& key, Variable) override {
    changed.push_back(key.channel);
  }

  /// Lets time pass until it has something to do, and `late` more.
  void time_passes(std::chrono::nanoseconds late = {}) {
    if (const auto next = sut.next_time()) {
      time.steady = *next + late;
    }
    sut.on_time(time);
    sut.finish(time);
  }
  /// Each time `late`.
  void time_passes_until_linked(std::chrono::nanoseconds late = {}) {
    for (int times = 0; times < 20 && !linked; ++times) {
      time_passes(late);
    }
    EXPECT_TRUE(linked);
  }
  void serve() {
    time_passes();
    sut.on_link_up("cnc", {1, 2}, time);
  }
  /// A sample of another gateway.
  static fabric::MachineStatus claim(std::chrono::seconds since) {
    fabric::MachineStatus status;
    status.machine = "cnc";
    status.gateway = gateway_id(9);
    status.claimed = machines::Claims::earliest + since;
    status.connected = true;
    status.host = "host7";
    status.pid = 1;
    status.epoch = other_epoch;
    return status;
  }
  static fabric::ChannelStatus call(std::uint64_t epoch, fabric::ChannelState state,
                                    std::uint32_t attempt) {
    fabric::ChannelStatus status;
    status.key = {"cnc", 1};
    status.state = state;
    status.call = {epoch, 5};
    status.attempt = attempt;
    return status;
  }

  MachinePorts ports;
  Moment& time = ports.time;
  bool& linked = ports.linked;
  fabric::MachineStatus& published = ports.published;
  int& times_published = ports.times_published;
  std::vector<Channels>& watched = ports.watched;
  std::vector<Channels>& unwatched = ports.unwatched;
  std::vector<std::string>& log_lines = ports.log_lines;
  std::vector<std::uint16_t> served;
  std::vector<std::pair<std::uint16_t, std::string>> predecessor_calls;
  std::map<std::uint16_t, bool> trusted;
  std::vector<std::uint16_t> changed;
  core::Machines sut{{gateway_id(5), "host1", 4711, "1", own_epoch}, ports, ports, *this};
};

}  // namespace millrace::gateway
