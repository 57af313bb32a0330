// millrace-mail: sends mails for NC programs.
#include <algorithm>
#include <csignal>
#include <iostream>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "services/mail/postman.hpp"
#include "services/mail/smtp.hpp"
#include "services/sdk/command_line.hpp"

namespace {

using namespace millrace;
namespace program = base::program;
namespace sdk = services::sdk;
namespace mail = services::mail;

mail::Config configuration(const std::string& file) {
  auto config = mail::load(file);
  if (!config) {
    throw program::UsageError(config.error());
  }
  if (const auto secret = mail::password(config->server); !secret) {
    throw program::UsageError(file + ": server: " + secret.error());
  }
  return *std::move(config);
}

mail::CallInfo info(const sdk::Call& call) {
  return {.call = call.id(),
          .key = call.channel(),
          .state = call.state(),
          .request = call.text(),
          .replayed = call.replayed()};
}

constexpr const char* config_help = "Server, recipients and templates (mail.textproto)";

/// --check: reads the configuration and serves nothing.
int check(int argc, char** argv) {
  CLI::App app{"Says whether a configuration of the mail service is good"};
  std::string file;
  bool yes = false;
  app.add_option("--config", file, config_help)->required();
  app.add_flag("--check", yes, "Read the configuration, say what is wrong with it, and end");
  return program::run(app, argc, argv, [&] {
    const mail::Config config = configuration(file);
    std::cout << fmt::format("{} is good: {} templates, {} recipients, server {}:{} {}\n", file,
                             config.templates.size(), config.recipients.size(), config.server.host,
                             config.server.port,
                             config.server.starttls ? "with STARTTLS" : "in the clear");
    return program::exit_done;
  });
}

int serve(int argc, char** argv) {
  // A server that hangs up is an error of its connection, not the end of the service.
  std::signal(SIGPIPE, SIG_IGN);
  // A repeated call sends no second mail, so it may come as often as it likes to the same spool.
  sdk::ServiceProgram service({.uuid = "b536e110-ca9e-4198-bddb-64331366bedb",
                               .name = "mail",
                               .description = "Sends mails for NC programs",
                               .version = MILLRACE_VERSION,
                               .delivery = fabric::Delivery::at_least_once,
                               .concurrency = 4});
  std::string file;
  bool no = false;
  service.app().add_option("--config", file, config_help)->required();
  service.app().add_flag("--check", no,
                         "Read the configuration, say what is wrong with it, and end");
  std::optional<mail::Smtp> smtp;
  std::optional<mail::Postman> postman;
  const std::function<sdk::Handler()> make = [&]() -> sdk::Handler {
    const mail::Config config = configuration(file);
    smtp.emplace(config.server);
    postman.emplace(config, mail::Spool(config.spool), *smtp, service.log());
    return [&](const sdk::Call& call) { return postman->answer(info(call)); };
  };
  return service.run(argc, argv, make);
}

}  // namespace

int main(int argc, char** argv) {
  const auto is_check = [](std::string_view argument) { return argument == "--check"; };
  return std::any_of(argv, argv + argc, is_check) ? check(argc, argv) : serve(argc, argv);
}
