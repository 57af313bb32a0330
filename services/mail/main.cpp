// millrace-mail: sends mails for NC programs.
#include <csignal>
#include <optional>
#include <string_view>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/version.hpp"
#include "fabric/observer/observer.hpp"
#include "services/mail/mail_sender.hpp"
#include "services/mail/rule_watch.hpp"
#include "services/mail/smtp.hpp"
#include "services/sdk/command_line.hpp"

namespace {

using namespace millrace;
namespace program = base::program;
namespace sdk = services::sdk;
namespace mail = services::mail;

fabric::Moment moment_now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

/// Watches the fabric for occasions of rules, on its own thread, and passes their mails to the
/// mail_sender, which must outlive it.
class RuleThread final : public fabric::observer::ObserverListener {
 public:
  /// Throws std::runtime_error if joining the fabric fails.
  RuleThread(const fabric::dds::ParticipantOptions& join, std::string flags,
             mail::Config configured, mail::MailSender& sender, program::Log the_log)
      : config(std::move(configured)),
        mail_sender(sender),
        log(std::move(the_log)),
        watch(config.rules, std::move(flags), moment_now()),
        participant(join) {
    observer.emplace(participant, context.get_executor(), *this,
                     fabric::observer::Interest::states);
    arm();
    thread = std::thread([this] { context.run(); });
  }

  ~RuleThread() override {
    context.stop();
    thread.join();
  }

 private:
  void on_entry(fabric::observer::Entry entry) override {
    watch.on_entry(entry, moment_now());
    carry_out();
  }

  void carry_out() {
    for (const std::string& line : watch.take_lines()) {
      log->warn("{}", line);
    }
    for (const mail::RuleEvent& occasion : watch.take()) {
      const mail::Rule& rule = config.rules.at(occasion.rule);
      const std::string id = occasion.id.to_string();
      const bool is_new =
          mail_sender.post(occasion.id, mail::compose(config, rule, occasion.values, occasion.id,
                                                      std::chrono::system_clock::now()));
      if (is_new) {
        log->info("rule {}: mail {} is on its way", rule.name, id);
      }
    }
    arm();
  }

  void arm() {
    const auto next = watch.next_time();
    if (next == armed) {
      return;
    }
    armed = next;
    timer.cancel();
    if (!next) {
      return;
    }
    timer.expires_at(*next);
    timer.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        armed.reset();
        watch.on_time(moment_now());
        carry_out();
      }
    });
  }

  const mail::Config config;
  mail::MailSender& mail_sender;
  program::Log log;
  mail::RuleWatch watch;
  fabric::dds::Participant participant;
  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  boost::asio::steady_timer timer{context};
  std::optional<fabric::SteadyTime> armed;
  std::optional<fabric::observer::Observer> observer;
  std::thread thread;
};

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

constexpr const char* config_help = "Server, recipients and templates (mail.textproto)";

std::string checked(const std::string& file) {
  const mail::Config config = program::must(mail::load(file));
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
                               .version = program::version(),
                               .delivery = fabric::Delivery::at_least_once,
                               .concurrency = 4});
  std::string file;
  service.app().add_option("--config", file, config_help)->type_name("FILE")->required();
  program::add_check(service.app());
  std::optional<mail::Smtp> smtp;
  std::optional<mail::MailSender> mail_sender;
  std::optional<RuleThread> rules;
  const std::function<sdk::Handler()> make = [&]() -> sdk::Handler {
    const mail::Config config = program::must(mail::load(file));
    if (const auto secret = mail::password(config.server); !secret) {
      throw program::UsageError(file + ": server: " + secret.error());
    }
    smtp.emplace(config.server);
    mail_sender.emplace(config, mail::Spool(config.spool), *smtp, service.log(), service.alarms());
    if (!config.rules.empty()) {
      rules.emplace(service.join_as("mail observer"), service.given_flags(), config, *mail_sender,
                    service.log());
    }
    return [&](const sdk::Call& call) { return mail_sender->answer(call.request()); };
  };
  return service.run(argc, argv, make);
}

}  // namespace

int main(int argc, char** argv) {
  return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                             : serve(argc, argv);
}
