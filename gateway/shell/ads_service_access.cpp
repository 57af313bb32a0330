#include "gateway/shell/ads_service_access.hpp"

#include <algorithm>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "base/program/barrier.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;
using cnc::ads::ErrorCode;

bool link_gone(ErrorCode code) {
  return code == ErrorCode::link_lost || code == ErrorCode::link_down ||
         code == ErrorCode::cancelled;
}

WriteOutcome outcome_of(ErrorCode code) {
  return cnc::ads::leaves_outcome_unknown(code) ? WriteOutcome::unknown : WriteOutcome::refused;
}

ServiceSnapshot snapshot_of(ReadSet set, std::vector<cnc::variables::ServiceValue> values) {
  ServiceSnapshot snapshot;
  snapshot.set = set;
  const auto variables = variables_of(set);
  for (std::size_t i = 0; i < variables.size(); ++i) {
    switch (variables[i]) {
      case Variable::uuid:
        snapshot.uuid = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request:
        snapshot.request = std::get<std::string>(std::move(values[i]));
        break;
      case Variable::request_state:
        snapshot.request_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response_state:
        snapshot.response_state = std::get<std::uint32_t>(values[i]);
        break;
      case Variable::response:
        snapshot.response = std::get<std::string>(std::move(values[i]));
        break;
    }
  }
  return snapshot;
}

ServiceSnapshot snapshot_of(std::uint32_t request_state) {
  ServiceSnapshot snapshot;
  snapshot.set = ReadSet::state;
  snapshot.request_state = request_state;
  return snapshot;
}

/// In one request: a controller processes the items of a sum one after the other, and other
/// requests wait.
constexpr std::size_t most_together = 64;

}  // namespace

AdsServiceAccess::AdsServiceAccess(asio::any_io_executor executor, std::string machine,
                                   cnc::ads::Client& client, machines::ControllerEvents& events)
    : executor_(std::move(executor)),
      machine_(std::move(machine)),
      client_(client),
      events_(events),
      states_(client) {}

void AdsServiceAccess::begin(const cnc::variables::Location& location,
                             const std::vector<std::uint16_t>& channels) {
  if (location_.group != location.group) {
    location_ = location;
    interfaces_.clear();
  }
  for (const std::uint16_t channel : channels) {
    of(channel).forget();
  }
  states_.forget(location_);
}

cnc::variables::ServiceInterface& AdsServiceAccess::of(std::uint16_t channel) {
  const cnc::variables::ServiceAccess access{.location = location_};
  return interfaces_.try_emplace(channel, client_, channel, access).first->second;
}

void AdsServiceAccess::read(const Link& link, std::uint16_t channel, ReadSet set) {
  if (set != ReadSet::state) {
    asio::co_spawn(executor_, read_one(link, channel, set), base::program::rethrow_from_loop);
    return;
  }
  due_.push_back(channel);
  if (due_.size() == 1) {
    asio::post(executor_, [this, link] { read_together(link); });
  }
}

void AdsServiceAccess::read_together(const Link& link) {
  const Channels due = std::exchange(due_, {});
  if (due.size() == 1) {
    asio::co_spawn(executor_, read_one(link, due.front(), ReadSet::state),
                   base::program::rethrow_from_loop);
    return;
  }
  for (std::size_t i = 0; i < due.size(); i += most_together) {
    const auto end = std::min(i + most_together, due.size());
    Channels some(due.begin() + static_cast<std::ptrdiff_t>(i),
                  due.begin() + static_cast<std::ptrdiff_t>(end));
    asio::co_spawn(executor_, read_states(link, std::move(some)), base::program::rethrow_from_loop);
  }
}

asio::awaitable<void> AdsServiceAccess::read_one([[maybe_unused]] Link link, std::uint16_t channel,
                                                 ReadSet set) {
  const auto looked_at = variables_of(set);
  std::vector<Variable> variables(looked_at.begin(), looked_at.end());
  auto values = co_await of(channel).read(std::move(variables));
  if (!values) {
    // A closed connection responds at once, from within read().
    co_await asio::post(executor_, asio::use_awaitable);
  }
  if (stopped_) {
    co_return;
  }
  if (values) {
    events_.on_read({machine_, channel}, snapshot_of(set, std::move(*values)));
  } else {
    read_failed(channel, values.error());
  }
}

asio::awaitable<void> AdsServiceAccess::read_states([[maybe_unused]] Link link, Channels channels) {
  const auto found = co_await states_.read(channels);
  for (std::size_t i = 0; i < channels.size() && !stopped_; ++i) {
    if (found[i]) {
      events_.on_read({machine_, channels[i]}, snapshot_of(*found[i]));
    } else {
      read_failed(channels[i], found[i].error());
    }
  }
}

void AdsServiceAccess::read_failed(std::uint16_t channel, ErrorCode code) {
  events_.on_read_failed(
      {machine_, channel},
      link_gone(code)
          ? std::string()
          : fmt::format("the controller refuses to read the Service Interface of channel {}: {}",
                        channel, cnc::ads::describe(code)));
}

void AdsServiceAccess::write(const Link& link, std::uint16_t channel, Variable variable,
                             const Value& value) {
  asio::co_spawn(executor_, write_one(link, channel, variable, value),
                 base::program::rethrow_from_loop);
}

asio::awaitable<void> AdsServiceAccess::write_one([[maybe_unused]] Link link, std::uint16_t channel,
                                                  Variable variable, Value value) {
  const auto written = co_await of(channel).write(variable, std::move(value));
  if (!written) {
    co_await asio::post(executor_, asio::use_awaitable);
  }
  if (stopped_) {
    co_return;
  }
  const fabric::ChannelKey key{machine_, channel};
  if (written) {
    events_.on_write(key, WriteOutcome::written, "");
  } else {
    events_.on_write(key, outcome_of(written.error()),
                     fmt::format("{} of channel {} cannot be written: {}", name_of(variable),
                                 channel, cnc::ads::describe(written.error())));
  }
}

}  // namespace millrace::gateway::shell
