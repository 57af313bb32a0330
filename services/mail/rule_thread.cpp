#include "services/mail/rule_thread.hpp"

#include <optional>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <spdlog/spdlog.h>

#include "fabric/observer/observer.hpp"
#include "services/mail/compose.hpp"
#include "services/mail/rule_watch.hpp"

namespace millrace::services::mail {

namespace {

fabric::Moment moment_now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

}  // namespace

struct RuleThread::Impl final : fabric::observer::ObserverListener {
  Impl(const fabric::dds::ParticipantOptions& join, const Config& the_config,
       MailSender& the_postman, base::program::Log the_log)
      : config(the_config),
        mail_sender(the_postman),
        log(std::move(the_log)),
        watch(config.rules, moment_now()),
        participant(join),
        timer(context) {
    using fabric::observer::Interest;
    states.emplace(participant, context.get_executor(), *this, Interest::states);
    programs.emplace(participant, context.get_executor(), *this, Interest::data);
    arm();
    thread = std::thread([this] { context.run(); });
  }

  ~Impl() override {
    context.stop();
    thread.join();
  }

  void on_entry(fabric::observer::Entry entry) override {
    watch.on_entry(entry, moment_now());
    carry_out();
  }

  void carry_out() {
    for (const std::string& line : watch.take_lines()) {
      log->warn("{}", line);
    }
    for (const RuleEvent& occasion : watch.take()) {
      const Rule& rule = config.rules.at(occasion.rule);
      const std::string id = occasion.id.to_string();
      const bool is_new = mail_sender.post(
          occasion.id,
          compose(config, rule, occasion.values, occasion.id, std::chrono::system_clock::now()));
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

  const Config config;
  MailSender& mail_sender;
  base::program::Log log;
  RuleWatch watch;
  fabric::dds::Participant participant;
  boost::asio::io_context context;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  boost::asio::steady_timer timer;
  std::optional<fabric::SteadyTime> armed;
  std::optional<fabric::observer::Observer> states;
  std::optional<fabric::observer::Observer> programs;
  std::thread thread;
};

RuleThread::RuleThread(const fabric::dds::ParticipantOptions& join, const Config& config,
                       MailSender& mail_sender, base::program::Log log)
    : impl_(std::make_unique<Impl>(join, config, mail_sender, std::move(log))) {}

RuleThread::~RuleThread() = default;

}  // namespace millrace::services::mail
