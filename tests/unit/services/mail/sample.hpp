// A configuration and calls for the tests of the mail service.
#pragma once

#include "services/mail/compose.hpp"

namespace millrace::services::mail {

inline Config sample_config() {
  Config config;
  config.from = {"Press 1", "press1@example.com"};
  config.recipients["shift"] = {{"Eva", "eva@example.com"}, {"", "bob@example.com"}};
  config.recipients["boss"] = {{"", "boss@example.com"}};
  config.templates.insert_or_assign(
      "done", MailTemplate{.to = {"shift"},
                           .subject = Template::parse("{program}: {parts} parts").value(),
                           .text = Template::parse("{call.machine}/{call.channel} {call.state} "
                                                   "{call.id} {call.time}: {call.request}")
                                       .value()});
  config.templates.insert_or_assign(
      "alarm",
      MailTemplate{.to = {}, .subject = Template::parse("Alarm").value(), .text = Template()});
  return config;
}

inline fabric::Request sample_call(const std::string& request, std::uint64_t number = 3) {
  return {.key = {.machine = "cnc", .channel = 2},
          .call = {.epoch = 0x5f, .number = number},
          .text = request,
          .state = 9};
}

}  // namespace millrace::services::mail
