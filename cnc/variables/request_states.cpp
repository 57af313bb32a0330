#include "cnc/variables/request_states.hpp"

#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

constexpr auto variable = ServiceVariable::request_state;

Result<std::uint32_t> state_of(const Result<Bytes>& answer) {
  return answer.and_then([](const Bytes& bytes) { return decode_value(variable, bytes); })
      .map([](const ServiceValue& value) { return std::get<std::uint32_t>(value); });
}

}  // namespace

asio::awaitable<std::vector<Result<std::uint32_t>>> RequestStates::read(
    std::vector<std::uint16_t> channels) {
  std::vector<Result<std::uint32_t>> states;
  if (sums_) {
    const auto answers = co_await read_in_a_sum(channels);
    const bool no_sums =
        !answers && (is_refusal(answers.error()) || answers.error() == ErrorCode::protocol_error);
    if (!no_sums) {
      for (std::size_t i = 0; i < channels.size(); ++i) {
        states.push_back(answers ? state_of((*answers)[i]) : tl::make_unexpected(answers.error()));
      }
      co_return states;
    }
    sums_ = false;
  }
  for (const std::uint16_t channel : channels) {
    const auto answer = co_await Channel(client_, channel, location_)
                            .read(name_of(variable), read_length(variable));
    states.push_back(state_of(answer));
  }
  co_return states;
}

asio::awaitable<Result<RequestStates::Answers>> RequestStates::read_in_a_sum(
    const std::vector<std::uint16_t>& channels) {
  std::vector<ads::SumItem> items;
  items.reserve(channels.size());
  for (const std::uint16_t channel : channels) {
    items.push_back(
        Channel(client_, channel, location_).item(name_of(variable), read_length(variable)));
  }
  // A sum belongs to the port, so any channel can send it.
  Channel any(client_, channels.front(), location_);
  auto answers = co_await any.read(std::move(items));
  co_return answers;
}

}  // namespace millrace::cnc::variables
