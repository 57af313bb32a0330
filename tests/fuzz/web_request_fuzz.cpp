// Foreign requests: the path from the bytes of a request to the response, without sockets. There is
// no command unless an open session asked for it.
#include <cassert>
#include <cstdint>
#include <string>

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "tools/web/actions/user_actions.hpp"
#include "tools/web/http/site.hpp"
#include "tools/web/live/messages.hpp"

namespace {

using namespace millrace::tools::web;

struct Server {
  plant::PlantModel plant{{}};
  http::Pages pages;
  int secrets = 0;
  actions::UserActions user_actions{
      {.users = {{"anna", {.name = "anna", .may = {millrace::fabric::CommandKind::answer}}}}},
      [](const millrace::fabric::Command&) { return std::optional<millrace::fabric::Outcome>(); },
      [](const plant::Acknowledgement&, const millrace::fabric::Moment&) {},
      [this] { return "s" + std::to_string(++secrets); },
      millrace::base::program::no_log()};
  http::Site site{{.plant = plant,
                   .pages = pages,
                   .recordings = std::make_shared<http::Recordings>("/nonexistent"),
                   .metrics = [] { return std::string(); },
                   .action_handler = &user_actions}};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Server server;
  boost::beast::http::request_parser<boost::beast::http::string_body> parser;
  parser.eager(true);
  parser.header_limit(16 * 1024);
  parser.body_limit(16 * 1024);
  boost::system::error_code error;
  const auto read = parser.put(boost::asio::buffer(data, size), error);
  if (error || !parser.is_header_done()) {
    return 0;
  }
  http::Request request = live::request_of(parser.get(), "127.0.0.1");
  // All bytes after the header, whatever length it gave.
  request.body.assign(reinterpret_cast<const char*>(data) + read, size - read);
  const http::Outcome outcome = server.site.answer(request, {});
  if (const auto* response = std::get_if<http::Response>(&outcome)) {
    const std::string head = live::head_text(*response, {.length = response->body->size()});
    // One header: no input has ended it early.
    assert(head.find("\r\n\r\n") == head.size() - 4);
    assert(response->status >= 200 && response->status < 600);
  } else if (const auto* later = std::get_if<http::Later>(&outcome)) {
    if (later->worker == http::WorkerKind::recordings) {
      assert(later->work()().status >= 400);
    } else {
      // No user is logged in.
      assert(request.target.find("login") != std::string::npos ||
             later->worker == http::WorkerKind::doctor);
    }
  } else {
    assert(std::holds_alternative<http::StreamLive>(outcome));
  }
  static_cast<void>(actions::command_of("answer", request.body));
  static_cast<void>(actions::command_of("retry", request.body));
  static_cast<void>(actions::command_of("drain", request.body));
  return 0;
}
