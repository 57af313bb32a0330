#include "cnc/variables/probe.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "cnc/variables/objects.hpp"
#include "cnc/variables/service_variable.hpp"
#include "cnc/variables/state_subscriptions.hpp"

namespace millrace::cnc::variables {

namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

struct Task {
  std::uint16_t port = 0;
  std::string_view name;
  std::string_view without;
};

/// The consequence if a task is missing; the Service Interface is in SDA.
constexpr std::array tasks{Task{geo_port, "GEO", "no machine data of this task"},
                           Task{sda_port, "SDA", "no Service Interface: does the CNC run?"},
                           Task{com_port, "COM", "no machine data of this task"}};

std::string words_of(std::uint16_t ads_state) {
  switch (ads_state) {
    case 5:
      return "run";
    case 6:
      return "stop";
    case 11:
      return "error";
    case 15:
      return "config";
    default:
      return fmt::format("ADS state {}", ads_state);
  }
}

asio::awaitable<Answer> ask_task(ads::Client& client, Task task) {
  const auto what = fmt::format("AMS port {} ({})", task.port, task.name);
  const auto state = co_await client.state(task.port);
  // A task may exist without support for ReadState.
  if (!state && state.error() != ErrorCode::service_not_supported) {
    co_return Answer{what, fmt::format("{}: {}", ads::describe(state.error()), task.without),
                     task.port == sda_port ? Verdict::missing : Verdict::optional};
  }
  const auto info = co_await client.info(task.port);
  co_return Answer{what, fmt::format("{}{}", state ? words_of(state->ads) : "answers",
                                     info ? fmt::format(", {} {}.{}.{}", info->name, info->major,
                                                        info->minor, info->build)
                                          : "")};
}

asio::awaitable<Answer> ask_channel(ads::Client& client, std::uint32_t number, Location location) {
  Answer answer{fmt::format("channel {}", number), {}};
  Channel channel(client, number, location);
  for (const ServiceVariable variable : all_service_variables) {
    const auto bytes = co_await channel.read(name_of(variable), read_length(variable));
    const auto value =
        bytes.and_then([&](const Bytes& raw) { return decode_value(variable, raw); });
    std::string words;
    if (!value) {
      words = ads::describe(value.error());
      answer.verdict = Verdict::missing;
    } else if (const auto* const text = std::get_if<std::string>(&*value)) {
      words = fmt::format("\"{}\"", *text);
    } else {
      words = fmt::format("{}", std::get<std::uint32_t>(*value));
    }
    answer.answer += fmt::format("{}{} {}", answer.answer.empty() ? "" : ", ",
                                 name_of(variable).substr(name_of(variable).rfind('.') + 1), words);
  }
  co_return answer;
}

asio::awaitable<Answer> ask_sum(ads::Client& client, Location location) {
  Channel channel(client, 1, location);
  std::vector<ads::SumItem> items;
  for (const ServiceVariable variable : all_service_variables) {
    items.push_back(channel.item(name_of(variable), read_length(variable)));
  }
  const auto together = co_await read_together(client, location.port, std::move(items));
  co_return together ? Answer{"sum commands", "five variables in one request"}
                     : Answer{"sum commands",
                              fmt::format("{}: each variable needs its own request",
                                          ads::describe(together.error())),
                              Verdict::optional};
}

asio::awaitable<Answer> ask_notifications(ads::Client& client, std::uint32_t channels,
                                          std::string symbol) {
  StateSubscriptions subscriptions(client, std::move(symbol), [](auto&&...) {});
  std::vector<std::uint16_t> all(channels);
  std::iota(all.begin(), all.end(), std::uint16_t{1});
  const auto outcomes = co_await subscriptions.subscribe(all);
  co_await subscriptions.unsubscribe(all);
  const auto refused = std::ranges::find_if(outcomes, [](const SubscriptionOutcome& outcome) {
    return outcome.error != ErrorCode::none;
  });
  co_return refused == outcomes.end()
      ? Answer{"notifications", "of REQUEST_STATE and RESPONSE_STATE are granted"}
      : Answer{"notifications", fmt::format("{}: the gateway polls", refused->refusal),
               Verdict::optional};
}

}  // namespace

asio::awaitable<Probe> probe(ads::Client& client, std::string symbol) {
  Probe found;
  for (const Task& task : tasks) {
    auto answer = co_await ask_task(client, task);
    found.answers.push_back(std::move(answer));
  }
  if (std::ranges::count(found.answers, Verdict::missing, &Answer::verdict) > 0) {
    co_return found;
  }
  const auto location = co_await locate(client, 1);
  Result<Survey> channels = tl::make_unexpected(location ? ErrorCode::none : location.error());
  if (location) {
    channels = co_await survey(client, *location);
  }
  found.channels = channels ? channels->channels : 0;
  found.answers.push_back({"Service Interface",
                           channels ? channels->finding.text : ads::describe(channels.error()),
                           found.channels > 0 ? Verdict::there : Verdict::missing});
  if (found.channels == 0) {
    co_return found;
  }
  for (std::uint32_t number = 1; number <= found.channels; ++number) {
    auto answer = co_await ask_channel(client, number, *location);
    found.answers.push_back(std::move(answer));
  }
  auto sums = co_await ask_sum(client, *location);
  found.answers.push_back(std::move(sums));
  auto notifications = co_await ask_notifications(client, found.channels, std::move(symbol));
  found.answers.push_back(std::move(notifications));
  co_return found;
}

namespace {

constexpr auto probed = ServiceVariable::request_state;

// The error code for an unknown name is not documented; an unknown channel is an unknown index
// group (inferred).
base::messages::Message message_for_none(const Location& location, ErrorCode refusal) {
  const auto question = fmt::format("{} of channel 1 (AMS port {}, index group {:#x})",
                                    name_of(probed), location.port, location.group + 1);
  return refusal == ErrorCode::invalid_group
             ? base::messages::no_channel_found(question, ads::describe(refusal),
                                                fmt::format("{:#x}", new_group_bit))
             : base::messages::no_service_interface(question, ads::describe(refusal));
}

}  // namespace

asio::awaitable<Result<Location>> locate(ads::Client& client, std::uint32_t channel,
                                         Location first) {
  Location other = first;
  other.group ^= new_group_bit;
  for (const Location& location : {first, other}) {
    Channel prober(client, channel, location);
    const auto answer = co_await prober.read(name_of(probed), read_length(probed));
    if (answer) {
      co_return location;
    }
    if (!is_refusal(answer.error())) {
      co_return tl::make_unexpected(answer.error());
    }
    if (answer.error() != ErrorCode::invalid_group) {
      break;  // the group exists, without such a variable
    }
  }
  co_return first;
}

asio::awaitable<Result<Survey>> survey(ads::Client& client, Location location,
                                       std::uint32_t limit) {
  for (std::uint32_t number = 1; number <= limit; ++number) {
    Channel channel(client, number, location);
    const auto answer = co_await channel.read(name_of(probed), read_length(probed));
    if (answer) {
      continue;
    }
    if (!is_refusal(answer.error())) {
      co_return tl::make_unexpected(answer.error());
    }
    const auto channels = number - 1;
    base::messages::Message finding =
        channels == 0 ? message_for_none(location, answer.error())
                      : base::messages::Message(
                            fmt::format("channels 1 to {} have a Service Interface", channels));
    co_return Survey{channels, std::move(finding)};
  }
  co_return Survey{limit, fmt::format("channels 1 to {} have a Service Interface", limit)};
}

}  // namespace millrace::cnc::variables
