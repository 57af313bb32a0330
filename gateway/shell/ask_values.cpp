#include "gateway/shell/ask_values.hpp"

#include <utility>
#include <variant>

namespace millrace::gateway::shell {

boost::asio::awaitable<machines::Answer> ask_values(std::shared_ptr<ValueSource> source,
                                                    machines::Question question) {
  cnc::variables::Readings& readings = source->readings;
  const std::uint64_t before = readings.requests();
  machines::Answer answer;
  answer.requester = question.requester;
  answer.number = question.number;
  if (auto* look_up = std::get_if<data::Resolve>(&question.step)) {
    answer.found = co_await readings.look_up(look_up->channel, std::move(look_up->names));
  } else if (auto* read = std::get_if<data::Read>(&question.step)) {
    const std::uint16_t port = read->readings.front().port;
    answer.found = co_await readings.read(std::move(read->readings));
    answer.sums = readings.sums(port);
  } else if (auto* write = std::get_if<variables::WriteOne>(&question.step)) {
    cnc::variables::Channel channel(source->client, write->channel, source->location);
    answer.found = co_await channel.write(write->name, write->value);
    answer.requests = 1;
    co_return answer;
  } else {
    const auto& list = std::get<variables::ListPage>(question.step);
    auto page = co_await readings.list_page(list.channel, list.family, list.first,
                                            fabric::variables_of_a_page);
    answer.found = std::move(page).map([](cnc::variables::Readings::Page&& found) {
      return variables::Page{found.total, std::move(found.variables)};
    });
  }
  answer.requests = readings.requests() - before;
  co_return answer;
}

}  // namespace millrace::gateway::shell
