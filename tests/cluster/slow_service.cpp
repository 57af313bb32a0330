// millrace-slow-service: a service for tests. It answers with the request's own text after a delay,
// and records each start of its handler.
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "services/sdk/command_line.hpp"
#include "tests/cluster/history/execution_log.hpp"

int main(int argc, char** argv) {
  using namespace millrace::services;
  using millrace::tests::cluster::ExecutionLog;
  sdk::ServiceProgram program({
      .uuid = "c0ffee00-0000-4000-8000-000000000001",
      .name = "slow",
      .description = "Answers with the request, after a while",
  });
  std::chrono::milliseconds work{0};
  std::string record;
  std::uint32_t interim = 0;
  program.app().add_option("--work", work, "How long each call takes, in milliseconds");
  program.app().add_option("--record", record, "File to which each execution is added")->required();
  std::uint32_t state = 1;
  program.app().add_option("--state", state, "State of each answer");
  program.app().add_option("--interim", interim, "Interim state to show first, 0 = none");
  std::string texts;
  program.app().add_option(
      "--texts", texts,
      "File to which the call and the text of each execution are added, a line each");
  return program.run(argc, argv, [&]() -> sdk::Handler {
    const auto log = std::make_shared<ExecutionLog>(record, program.options().name);
    return [=](const sdk::Call& call) -> sdk::Response {
      log->started(call.id(), call.attempt(), call.channel());
      if (!texts.empty()) {
        std::ofstream(texts, std::ios::app) << call.id().to_string() << ' ' << call.text() << '\n';
      }
      if (interim != 0) {
        call.interim({.text = "busy", .state = interim});
      }
      std::this_thread::sleep_for(work);
      log->finished(call.id(), call.attempt(), call.channel());
      return {.text = call.text(), .state = state};
    };
  });
}
