// millrace-http: URLs as services.
#include <csignal>
#include <optional>
#include <set>

#include <curl/curl.h>
#include <fmt/format.h>

#include "services/http/config.hpp"
#include "services/http/host.hpp"
#include "services/sdk/host_program.hpp"
#include "services/sdk/stop_signals.hpp"

namespace millrace::services::http {

namespace {

namespace program = base::program;

std::string counted(const std::vector<Endpoint>& endpoints) {
  std::set<std::string> uuids;
  for (const Endpoint& endpoint : endpoints) {
    uuids.insert(endpoint.announcement.uuid);
  }
  return fmt::format("{} {} with {} {}", uuids.size(), uuids.size() == 1 ? "UUID" : "UUIDs",
                     endpoints.size(), endpoints.size() == 1 ? "URL" : "URLs");
}

/// Secrets may be where only the service's unit can read them.
std::string checked(const std::string& file) {
  const std::vector<Endpoint> endpoints = program::must(load(file));
  if (const auto complete = with_secrets(endpoints); !complete) {
    fmt::print(stderr, "warning: the service needs a file that cannot be used here: {}\n",
               complete.error());
  }
  return counted(endpoints);
}

int serve(int argc, char** argv) {
  // A closed connection is an error of that connection and must not end the service.
  std::signal(SIGPIPE, SIG_IGN);
  std::string file = "http.textproto";
  sdk::HostProgram http("Answers calls with web servers", "http", [&](CLI::App& app) {
    app.add_option("--config", file, "Services and their URLs; changes are applied at once")
        ->type_name("FILE")
        ->capture_default_str();
  });
  return http.run(argc, argv, [&](const sdk::HostedProcess& process) {
    const std::vector<Endpoint> endpoints = program::must(load(file).and_then(with_secrets));
    if (const CURLcode code = curl_global_init(CURL_GLOBAL_DEFAULT); code != CURLE_OK) {
      throw std::runtime_error(fmt::format("libcurl cannot be used: {}", curl_easy_strerror(code)));
    }
    std::optional<Host> host;
    sdk::StopSignals signals(process.log);
    host.emplace(file, endpoints, process.services(), process.name, process.log);
    signals.on_stop([&] { host->stop(); });
    program::ready(fmt::format("{} serves {} of {} on domain {}", process.name, counted(endpoints),
                               file, process.join.domain));
    host->run();
    return program::exit_done;
  });
}

}  // namespace

}  // namespace millrace::services::http

int main(int argc, char** argv) {
  using namespace millrace::services::http;
  return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                             : serve(argc, argv);
}
