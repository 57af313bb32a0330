// millrace-mail: sends mails for NC programs.
#include <csignal>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "services/mail/mail_sender.hpp"
#include "services/mail/rule_thread.hpp"
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
  return *std::move(config);
}

std::string_view words_of(mail::Security security) {
  switch (security) {
    case mail::Security::none:
      return "in the clear";
    case mail::Security::starttls:
      return "with STARTTLS";
    case mail::Security::tls:
      return "with TLS";
  }
  return "";
}

mail::CallInfo info(const sdk::Call& call) {
  return {.call = call.id(),
          .key = call.channel(),
          .state = call.state(),
          .request = call.text(),
          .replayed = call.replayed()};
}

constexpr const char* config_help = "Server, recipients and templates (mail.textproto)";

std::string checked(const std::string& file) {
  const mail::Config config = configuration(file);
  std::string text =
      fmt::format("{} templates, {} recipients, {} rules, server {}:{} {}", config.templates.size(),
                  config.recipients.size(), config.rules.size(), config.server.host,
                  config.server.port, words_of(config.server.security));
  if (const auto secret = mail::password(config.server); !secret) {
    // The password may be where only the service's unit can read it.
    text +=
        fmt::format("\nIts password cannot be read here; the service needs it: {}", secret.error());
  }
  return text;
}

int serve(int argc, char** argv) {
  // A closed connection of a server is an error of that connection and must not end the service.
  std::signal(SIGPIPE, SIG_IGN);
  // A repeated call sends no second mail from the same spool, so delivery is at least once.
  sdk::ServiceProgram service({.uuid = "b536e110-ca9e-4198-bddb-64331366bedb",
                               .name = "mail",
                               .description = "Sends mails for NC programs",
                               .version = MILLRACE_VERSION,
                               .delivery = fabric::Delivery::at_least_once,
                               .concurrency = 4});
  std::string file;
  service.app().add_option("--config", file, config_help)->required();
  program::add_check(service.app());
  std::optional<mail::Smtp> smtp;
  std::optional<mail::MailSender> mail_sender;
  std::optional<mail::RuleThread> rules;
  const std::function<sdk::Handler()> make = [&]() -> sdk::Handler {
    const mail::Config config = configuration(file);
    if (const auto secret = mail::password(config.server); !secret) {
      throw program::UsageError(file + ": server: " + secret.error());
    }
    smtp.emplace(config.server);
    mail_sender.emplace(config, mail::Spool(config.spool), *smtp, service.log(), service.alarms());
    if (!config.rules.empty()) {
      const sdk::ServiceOptions& options = service.options();
      rules.emplace(fabric::dds::ParticipantOptions{.domain = options.domain,
                                                    .fabric = options.fabric,
                                                    .lease = options.lease,
                                                    .name = "mail observer",
                                                    .configuration = options.configuration,
                                                    .trust = options.trust},
                    config, *mail_sender, service.log());
    }
    return [&](const sdk::Call& call) { return mail_sender->answer(info(call)); };
  };
  return service.run(argc, argv, make);
}

}  // namespace

int main(int argc, char** argv) {
  return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                             : serve(argc, argv);
}
