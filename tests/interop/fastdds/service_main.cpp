// fastdds_service: answers with its request's own text, and prints what it does.
//
//   --domain N --fabric NAME --uuid UUID --name NAME
//   --trust FOLDER        from `millrace trust issue`; --protection SIGN or ENCRYPT
//   --certificate NAME    with --trust: the name in its certificate, for its identity
//   --concurrency N       calls at once, as announced
//   --room N              calls at once, actually; it declines the others
//   --work MS             duration of each call
//   --max-instances N     keys that its reader and writer may know at once, 0 = no limit
//   --block TEXT          the request with this text blocks it for 0.5 s in its listener, once
#include <array>
#include <atomic>
#include <csignal>
#include <iostream>

#include "arguments.hpp"
#include "service.hpp"
#include <unistd.h>

namespace {

using namespace millrace::tests::interop::fastdds;

std::string text_of_request(const millrace::Request& request) {
  return {request.text().begin(), request.text().end()};
}

/// One line, whole.
void say(const std::string& what, const millrace::Request& request) {
  std::cout << (what + " " + std::to_string(request.number()) + " attempt " +
                std::to_string(request.attempt()) + " of channel " +
                std::to_string(request.channel()) + ": " + text_of_request(request) + "\n")
            << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  // Blocked before other threads start, so that only this one takes SIGTERM.
  sigset_t leave;
  sigemptyset(&leave);
  sigaddset(&leave, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &leave, nullptr);

  const Arguments arguments(argc, argv);
  Service::Options options;
  options.identity.id = random_id();
  options.identity.uuid = arguments.text("--uuid", "fa57dd50-0000-4000-8000-000000000001");
  options.identity.name = arguments.text("--name", "fastdds");
  std::array<char, 64> host{};
  gethostname(host.data(), host.size() - 1);
  options.identity.host = host.data();
  options.identity.pid = static_cast<std::uint32_t>(getpid());
  options.identity.concurrency = static_cast<std::uint32_t>(arguments.number("--concurrency", 1));
  options.room = static_cast<std::uint32_t>(
      arguments.number("--room", static_cast<int>(options.identity.concurrency)));
  options.max_instances = arguments.number("--max-instances", 0);
  options.certificate = arguments.text("--certificate", "");
  const std::string blocking = arguments.text("--block", "");
  std::atomic<bool> blocked = false;
  options.on_request = [&](const millrace::Request& request) {
    say("request", request);
    if (!blocking.empty() && text_of_request(request) == blocking && !blocked.exchange(true)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      std::cout << "was blocked" << std::endl;
    }
  };
  const std::chrono::milliseconds work(arguments.number("--work", 0));

  Fabric fabric({.domain = static_cast<std::uint32_t>(arguments.number("--domain", 0)),
                 .name = arguments.text("--fabric", "millrace"),
                 .trust = arguments.text("--trust", ""),
                 .encrypt = arguments.text("--protection", "SIGN") == "ENCRYPT"});
  Service service(fabric, options, [&](const millrace::Request& request) -> Answer {
    say("run", request);
    std::this_thread::sleep_for(work);
    return {.text = text_of_request(request)};
  });
  std::cout << "ready: " << text_of(options.identity.id) << std::endl;
  int signal = 0;
  sigwait(&leave, &signal);
  service.leave();
  return 0;
}
