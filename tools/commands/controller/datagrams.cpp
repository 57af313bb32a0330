#include "tools/commands/controller/datagrams.hpp"

#include <array>
#include <stdexcept>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <fmt/format.h>

#include "base/loop/quietly.hpp"

namespace millrace::tools::commands::controller {

namespace asio = boost::asio;
using asio::ip::udp;
using base::loop::quietly;

asio::awaitable<std::vector<std::pair<std::string, cnc::ads::Datagram>>> ask(Question question) {
  std::vector<std::pair<std::string, cnc::ads::Datagram>> answers;
  // The timer's handler may come after this coroutine has ended.
  const auto socket = std::make_shared<udp::socket>(co_await asio::this_coro::executor,
                                                    udp::endpoint(question.from, 0));
  socket->set_option(asio::socket_base::broadcast(question.broadcast));
  const cnc::ads::Bytes bytes = cnc::ads::encode(question.datagram);
  for (const udp::endpoint& to : question.to) {
    const auto content = asio::buffer(bytes);
    const auto [error, size] = co_await socket->async_send_to(content, to, quietly);
    if (error) {
      throw std::runtime_error(fmt::format("cannot ask {}:{}: {}", to.address().to_string(),
                                           to.port(), error.message()));
    }
  }
  asio::steady_timer patience(socket->get_executor(), question.patience);
  patience.async_wait([socket](boost::system::error_code error) {
    if (!error) {
      boost::system::error_code ignored;
      socket->close(ignored);
    }
  });
  std::array<std::uint8_t, cnc::ads::max_datagram> room{};
  udp::endpoint peer;
  while (socket->is_open() && (question.broadcast || answers.size() < question.to.size())) {
    const auto buffer = asio::buffer(room);
    const auto [error, size] = co_await socket->async_receive_from(buffer, peer, quietly);
    const auto answer = cnc::ads::decode_datagram(cnc::ads::BytesView(room).first(size));
    if (!error && answer && answer->is_response &&
        answer->invoke_id == question.datagram.invoke_id) {
      answers.emplace_back(peer.address().to_string(), *answer);
    }
  }
  co_return answers;
}

}  // namespace millrace::tools::commands::controller
