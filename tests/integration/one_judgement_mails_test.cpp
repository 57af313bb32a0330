// Mails about faults made with real processes say the same as the page.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <regex>
#include <set>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/plant/concern.hpp"
#include "tests/integration/one_judgement.hpp"

namespace millrace::tests::integration {
namespace {

/// Mails of a rule for all concerns that need a person.
class OneJudgementInMails : public OneJudgement {
 protected:
  void SetUp() override {
    OneJudgement::SetUp();
    std::filesystem::create_directory(inbox);
    server.emplace(std::vector<std::string>{"/usr/bin/python3", MILLRACE_SMTP_SERVER,
                                            inbox.string(), "--port", "0"});
    const auto config = chain.folder() / "mail.textproto";
    std::ofstream(config) << "server { host: 'localhost' port: "
                          << server->await("^ready: (\\d+)").at(1)
                          << " starttls: OFF }\n"
                             "from: 'press@example.com'\n"
                             "recipient { name: 'shift' address: 'eva@example.com' }\n"
                             "rule { name: 'act' concern: ACT after_s: 0 quiet_s: 0 to: 'shift' "
                             "text: '{level} {kind} {subject}|{what}|{reason}|{who}|' }\n";
    mail.emplace(std::vector<std::string>{binary("millrace-mail"), "--config", config.string(),
                                          "--domain", std::to_string(chain.domain())});
    mail->await("^ready: ");
  }

  /// Waits until a mail and the page have this concern in the same words.
  void expect_mail(const std::string& concern) {
    await("a mail about " + concern, [&] {
      const boost::json::value all = page();
      const auto found = std::ranges::find(all.as_array(), concern, concern_of);
      if (found == all.as_array().end()) {
        return false;
      }
      std::string text = concern + (concern.ends_with(' ') ? "plant" : "");
      for (const char* field : {"what", "why", "who"}) {
        text += "|" + std::string(found->at(field).as_string());
      }
      kinds.emplace(found->at("kind").as_string());
      return mails().find(text + "|") != std::string::npos;
    });
  }
  /// Of all mails.
  [[nodiscard]] std::string mails() const {
    std::string all;
    for (int number = 1;; ++number) {
      std::ifstream file(inbox / (std::to_string(number) + ".mail"));
      if (!file) {
        // Without the soft line breaks of quoted-printable (RFC 2045, 6.7).
        return std::regex_replace(all, std::regex("=\r\n"), "");
      }
      all.append(std::istreambuf_iterator<char>(file), {});
    }
  }

  const std::filesystem::path inbox = chain.folder() / "inbox";
  std::optional<Process> server;
  std::optional<Process> mail;
  /// Those of which a mail was sent.
  std::set<std::string> kinds;
};

/// It needs no person, or none in the time that a test may take.
bool is_not_mailed(fabric::plant::Kind kind) {
  using enum fabric::plant::Kind;
  // `missing` is of `status` alone; `waiting` needs a person after a minute.
  return kind == missing || kind == overdue || kind == waiting || kind == redundancy ||
         kind == process_gone || kind == program_on_hold || kind == unknown;
}

TEST_F(OneJudgementInMails, IsSaidOfEachKindThatNeedsAPersonInTheSameWords) {
  expect_mail("act no gateway ");
  Process slow = chain.slow_service({"--work", "100000", "--delivery", "at-most-once"});
  service.emplace(chain.square_root());
  cnc.emplace(chain.cnc({"--channels", "4", "--run", "1=" + aborted_program(), "--run",
                         "2=" + calls_of("a5b5c5d5-0000-4000-8000-000000000001", "unserved"),
                         "--run", Chain::program(3, "one_slow_call.nc"), "--run",
                         "4=" + calls_of(square_root, "no number")}));
  gateway.emplace(chain.configured_gateway(with_programs,
                                           {"--journal", (chain.folder() / "journal").string()}));
  await("the call to run", [&] {
    const boost::json::value channels =
        boost::json::parse(HttpClient(port).get("/api/channels").body);
    return std::ranges::any_of(channels.as_array(), [](const boost::json::value& each) {
      return each.at("channel") == 3 && each.at("channel_state") == "running";
    });
  });
  slow.kill();
  const fabric::dds::Participant there({.domain = chain.domain()});
  boost::asio::io_context io;
  fabric::endpoints::AlarmEndpoint faults(there, io.get_executor(),
                                          {.program = "archiver", .host = "vm", .pid = 7});
  ASSERT_TRUE(faults.raise({.key = {.kind = "archive"},
                            .level = fabric::AlarmLevel::problem,
                            .text = "the disk is full",
                            .since = std::chrono::system_clock::now()}));
  expect_mail("act alarm archiver on vm, pid 7");
  expect_mail("act program aborted cnc/1");
  expect_mail("act unserved cnc/2");
  expect_mail("act held cnc/3");
  expect_mail("act errors " + square_root);

  rlimit before{};
  const rlimit none{.rlim_cur = 0, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &none, &before), 0);
  expect_mail("act journal cnc");
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  cnc->kill();
  expect_mail("act link down cnc");
  gateway->kill();
  expect_mail("act gateway gone cnc");

  using fabric::plant::Kind;
  for (auto kind = Kind::missing; kind <= Kind::unknown;
       kind = static_cast<Kind>(static_cast<int>(kind) + 1)) {
    EXPECT_NE(is_not_mailed(kind), kinds.contains(std::string(name_of(kind)))) << name_of(kind);
  }
}

}  // namespace
}  // namespace millrace::tests::integration
