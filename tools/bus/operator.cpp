#include "tools/bus/operator.hpp"

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include "base/posix/host.hpp"
#include "fabric/badge.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/dds/trust.hpp"
#include "fabric/wire/command_codec.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = std::chrono::steady_clock;

/// The command topic keeps nothing for those that are matched later, so it is said again.
constexpr auto repeat_after = std::chrono::milliseconds(100);

class Desk : public std::enable_shared_from_this<Desk> {
 public:
  Desk(fabric::dds::Participant& participant, const std::vector<fabric::Command>& commands)
      : participant_(participant),
        commands_(commands),
        writer_(participant, participant.options().fabric) {}

  void open(boost::asio::io_context& io) {
    post_.emplace(io.get_executor(), weak_from_this(), [this] { take(); });
    const fabric::dds::Listener on_outcome(dds_create_listener(nullptr));
    post_->listen_for_data(on_outcome.get());
    outcomes_.emplace(participant_, participant_.options().fabric, fabric::wire::Keep::all,
                      fabric::wire::EndpointOptions{.listener = on_outcome.get()});
  }

  /// Sends what has no outcome yet.
  void send() {
    for (const fabric::Command& command : commands_) {
      if (!heard.contains(command.id)) {
        sent_.insert_or_assign(command.id, Clock::now());
        fabric::Command named = command;
        const auto& trust = participant_.options().trust;
        named.issuer = fabric::issuer_of(trust ? trust->name : std::string(), command.issuer);
        if (const auto written = writer_.write(named); !written) {
          throw std::runtime_error(written.error());
        }
      }
    }
  }

  [[nodiscard]] bool done() const { return heard.size() == commands_.size(); }

  std::map<fabric::InstanceId, Heard> heard;

 private:
  void take() {
    for (auto batch = outcomes_->take(); !batch.empty(); batch = outcomes_->take()) {
      for (const fabric::wire::Taken<fabric::Outcome>& taken : batch) {
        const auto sent = sent_.find(taken.value.command);
        if (taken.valid && sent != sent_.end()) {
          heard.try_emplace(taken.value.command, Heard{taken.value, Clock::now() - sent->second,
                                                       std::chrono::system_clock::now()});
        }
      }
    }
  }

  fabric::dds::Participant& participant_;
  const std::vector<fabric::Command>& commands_;
  fabric::wire::Writer<fabric::Command> writer_;
  std::map<fabric::InstanceId, Clock::time_point> sent_;
  // Before the reader that wakes it.
  std::optional<fabric::dds::PostOnce> post_;
  std::optional<fabric::wire::Reader<fabric::Outcome>> outcomes_;
};

}  // namespace

std::map<fabric::InstanceId, Heard> issue(fabric::dds::Participant& participant,
                                          const std::vector<fabric::Command>& commands,
                                          std::chrono::milliseconds patience) {
  boost::asio::io_context io{1};
  const auto work = boost::asio::make_work_guard(io);
  const auto desk = std::make_shared<Desk>(participant, commands);
  desk->open(io);
  const auto end = Clock::now() + patience;
  auto next_sending = Clock::now();
  while (!desk->done() && Clock::now() < end) {
    if (Clock::now() >= next_sending) {
      desk->send();
      next_sending = Clock::now() + repeat_after;
    }
    io.run_one_until(std::min(next_sending, end));
  }
  return std::move(desk->heard);
}

std::string issuer_here() {
  const passwd* user = ::getpwuid(::geteuid());
  // At most 127 bytes fit.
  return fmt::format("{:.31}@{:.63}", user != nullptr ? user->pw_name : "unknown",
                     base::posix::host_name());
}

}  // namespace millrace::tools::bus
