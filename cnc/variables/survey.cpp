#include "cnc/variables/survey.hpp"

#include <fmt/format.h>

#include "cnc/variables/service_value.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

constexpr auto probed = ServiceVariable::request_state;

// The error code for an unknown name is not documented; an unknown channel is an unknown index
// group (inferred).
std::string words_for_none(const Location& location, ErrorCode refusal) {
  const auto question = fmt::format("{} of channel 1 (AMS port {}, index group {:#x})",
                                    name_of(probed), location.port, location.group + 1);
  if (refusal == ErrorCode::invalid_group) {
    return fmt::format(
        "no channel found: {} is refused: {}. Older controllers have index groups without {:#x}",
        question, ads::describe(refusal), new_group_bit);
  }
  return fmt::format(
      "the controller has no Service Interface: {} is refused: {}. TwinCAT 2 has it from "
      "V2.11.2030.01, TwinCAT 3 from V3.1.3057.03",
      question, ads::describe(refusal));
}

}  // namespace

asio::awaitable<Result<Location>> locate(ads::Client& client, std::uint32_t channel,
                                         Location first) {
  Location other = first;
  other.group ^= new_group_bit;
  for (const Location& location : {first, other}) {
    Channel one(client, channel, location);
    const auto answer = co_await one.read(name_of(probed), read_length(probed));
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
    auto finding = channels == 0
                       ? words_for_none(location, answer.error())
                       : fmt::format("channels 1 to {} have a Service Interface", channels);
    co_return Survey{channels, std::move(finding)};
  }
  co_return Survey{limit, fmt::format("channels 1 to {} have a Service Interface", limit)};
}

}  // namespace millrace::cnc::variables
