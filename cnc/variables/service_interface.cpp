#include "cnc/variables/service_interface.hpp"

#include <utility>

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::Result;
using Wanted = ServiceReads::Wanted;
using Values = ServiceReads::Values;

/// Takes the results of one channel, which begin at `answer`.
Result<Values> decode(const Wanted& wanted, const Result<Bytes>* answer) {
  Values values;
  for (const ServiceVariable variable : wanted.variables) {
    auto value =
        (answer++)->and_then([&](const Bytes& bytes) { return decode_value(variable, bytes); });
    if (!value) {
      return tl::make_unexpected(value.error());
    }
    values.push_back(std::move(*value));
  }
  return values;
}

bool has_several(const std::vector<Wanted>& wanted) {
  return wanted.size() > 1 || (wanted.size() == 1 && wanted.front().variables.size() > 1);
}

}  // namespace

asio::awaitable<Result<ServiceValue>> ServiceInterface::read(ServiceVariable variable) {
  const auto bytes = co_await channel_.read(name_of(variable), read_length(variable));
  co_return bytes.and_then(
      [variable](const Bytes& value) { return decode_value(variable, value); });
}

asio::awaitable<Result<void>> ServiceInterface::write(ServiceVariable variable,
                                                      ServiceValue value) {
  const auto bytes = encode_value(variable, value);
  if (!bytes) {
    co_return tl::make_unexpected(bytes.error());
  }
  auto written = co_await channel_.write(name_of(variable), *bytes);
  co_return written;
}

asio::awaitable<std::vector<Result<Values>>> ServiceReads::read(std::vector<Wanted> wanted) {
  Result<Answers> answers;
  bool done = false;
  if (sums_ && has_several(wanted)) {
    answers = co_await read_in_a_sum(wanted);
    done = answers || !ads::refuses_sums(answers.error());
    sums_ = done;
  }
  if (!done) {
    answers = co_await read_one_by_one(wanted);
  }
  std::vector<Result<Values>> results;
  std::size_t first = 0;
  for (const Wanted& variable : wanted) {
    results.push_back(answers ? decode(variable, answers->data() + first)
                              : tl::make_unexpected(answers.error()));
    first += variable.variables.size();
  }
  co_return results;
}

asio::awaitable<Result<Answers>> ServiceReads::read_in_a_sum(const std::vector<Wanted>& wanted) {
  std::vector<ads::SumItem> items;
  for (const Wanted& item : wanted) {
    const Channel channel(client_, item.channel, location_);
    for (const ServiceVariable variable : item.variables) {
      items.push_back(channel.item(name_of(variable), read_length(variable)));
    }
  }
  auto answers = co_await variables::read_together(client_, location_.port, std::move(items));
  co_return answers;
}

asio::awaitable<Answers> ServiceReads::read_one_by_one(const std::vector<Wanted>& wanted) {
  Answers answers;
  for (const Wanted& item : wanted) {
    Channel channel(client_, item.channel, location_);
    for (const ServiceVariable variable : item.variables) {
      auto answer = co_await channel.read(name_of(variable), read_length(variable));
      answers.push_back(std::move(answer));
    }
  }
  co_return answers;
}

}  // namespace millrace::cnc::variables
