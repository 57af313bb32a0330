// Alarms of programs on the fabric, and the tools that show them.
#include <filesystem>
#include <fstream>
#include <optional>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int exit_trouble = 6;

class ProcessAlarms : public testing::Test {
 protected:
  Process start(const std::string& name, Flags flags) {
    flags.insert(flags.begin(), binary(name));
    flags.insert(flags.end(), {"--domain", std::to_string(chain.domain())});
    Process process(std::move(flags));
    process.await("^ready: ");
    return process;
  }
  std::string configured(const std::string& name, const std::string& text) {
    const std::filesystem::path file = chain.folder() / name;
    std::ofstream(file) << text;
    return file.string();
  }
  /// Runs `millrace status` to its end; returns its exit code, and its output in `words`.
  int health() {
    Process process = chain.millrace({"status"});
    const int code = process.wait();
    words = process.output();
    return code;
  }
  void await_alarm() {
    await("an alarm", [&] { return health() == exit_trouble; });
  }
  void await_no_alarm() {
    await("the end of the alarm", [&] { return health() == 0; });
  }
  std::string output_of(Flags command) {
    Process process = chain.millrace(std::move(command));
    process.wait();
    return process.output();
  }

  /// A fabric without a gateway has a problem.
  void start_gateway() {
    cnc.emplace(chain.cnc());
    gateway.emplace(chain.gateway());
    gateway->await_error("link up");
  }

  Chain chain;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::string words;
};

TEST_F(ProcessAlarms, AnArchiverReportsThatItCannotWriteUntilItCan) {
  start_gateway();
  const std::filesystem::path folder = chain.folder() / "archive";
  const Process sut =
      start("millrace-archiver",
            {"--config", configured("archiver.textproto", "folder: '" + folder.string() + "'")});
  EXPECT_EQ(health(), 0) << words;
  SQLite::Database database((folder / "archive-000001.db").string(), SQLite::OPEN_READWRITE, 5000);
  for (const std::string table : {"put", "event", "channel"}) {
    database.exec("CREATE TRIGGER full_" + table + " BEFORE INSERT ON " + table +
                  " BEGIN SELECT RAISE(ABORT, 'disk full'); END");
  }
  const std::string uuid = "326de49a-633b-4cea-a9b8-1924d7f926a7";
  EXPECT_THAT(output_of({"call", uuid, "PUT part=7"}), HasSubstr("disk full"));
  await_alarm();
  EXPECT_THAT(words, AllOf(HasSubstr("archiver on "), HasSubstr("cannot be written: disk full"),
                           HasSubstr("free space")));
  EXPECT_THAT(output_of({"services"}), HasSubstr("cannot be written: disk full"));
  EXPECT_THAT(output_of({"services", "-i", "--json"}),
              AllOf(HasSubstr("\"alarms\":[{"), HasSubstr("\"level\":\"problem\"")));
  EXPECT_THAT(output_of({"doctor", "--json"}),
              AllOf(HasSubstr("\"healthy\":false"), HasSubstr("cannot be written: disk full")));
  for (const std::string table : {"put", "event", "channel"}) {
    database.exec("DROP TRIGGER full_" + table);
  }
  EXPECT_THAT(output_of({"call", uuid, "PUT part=7"}), HasSubstr("OK 1"));
  await_no_alarm();
}

TEST_F(ProcessAlarms, ARecorderReportsThatItRunsAndWhatItWrites) {
  start_gateway();
  const std::string file = (chain.folder() / "run.mcap").string();
  Process sut = chain.millrace({"record", "-o", file});
  sut.await("^ready: ");
  await("the alarm of the recorder",
        [&] { return output_of({"status"}).find("records to " + file) != std::string::npos; });
  // It has no calls, which is fine.
  EXPECT_EQ(health(), 0) << words;
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(output_of({"status"}), Not(HasSubstr("records to")));
}

TEST_F(ProcessAlarms, AreRecordedWithTheirEnd) {
  const std::string file = (chain.folder() / "run.mcap").string();
  Process sut = chain.millrace({"record", "-o", file});
  sut.await("^ready: ");
  {
    const std::filesystem::path other = chain.folder() / "other.mcap";
    Process another = chain.millrace({"record", "-o", other.string()});
    another.await("^ready: ");
    await("the alarm of the other recorder", [&] {
      return output_of({"status"}).find("records to " + other.string()) != std::string::npos;
    });
    another.terminate();
    EXPECT_EQ(another.wait(), 0);
  }
  const auto recorded = [&] {
    return output_of({"recording", "cat", "--kind", "alarm", file + ".part"});
  };
  await("the end of the other's alarm",
        [&] { return recorded().find("over") != std::string::npos; });
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  const std::string cat = output_of({"recording", "cat", "--kind", "alarm", file});
  EXPECT_THAT(cat, AllOf(HasSubstr("fine  recording"), HasSubstr("over  recording"),
                         HasSubstr("other.mcap")));
  // Its identity is in its metadata.
  EXPECT_THAT(cat, Not(HasSubstr("records to " + file)));
  EXPECT_THAT(output_of({"recording", "info", file}), HasSubstr("program/millrace record/alarm"));
  EXPECT_THAT(output_of({"recording", "export", file}), HasSubstr("\"alarm\":\"recording\""));
}

TEST_F(ProcessAlarms, ARecorderWithoutDiskSpaceReportsThatItRecordsNothing) {
  start_gateway();
  Process sut = chain.millrace({"record", "-o", (chain.folder() / "run.mcap").string(),
                                "--rotate-size", "1MiB", "--min-free", "1000000GiB"});
  sut.await_error("nothing is recorded until there is room");
  await_alarm();
  EXPECT_THAT(words, AllOf(HasSubstr("nothing is recorded: the disk of"), HasSubstr("free space")));
  sut.terminate();
  EXPECT_EQ(sut.wait(), 1);
}

TEST_F(ProcessAlarms, AMailServiceReportsWaitingMailsAndTheReason) {
  start_gateway();
  const Process sut =
      start("millrace-mail",
            {"--config", configured("mail.textproto",
                                    "server { host: '127.0.0.1' port: 1 starttls: OFF }\n"
                                    "from: 'press@example.com'\n"
                                    "recipient { name: 'shift' address: 'eva@example.com' }\n"
                                    "template { name: 'done' to: 'shift' subject: 's' text: 't' }\n"
                                    "spool: '" +
                                        (chain.folder() / "spool").string() + "'\n")});
  EXPECT_EQ(health(), 0) << words;
  EXPECT_THAT(output_of({"call", "b536e110-ca9e-4198-bddb-64331366bedb", "done"}),
              HasSubstr("sent later"));
  await("the alarm about the mail", [&] {
    return output_of({"status"}).find("1 mail waits for 127.0.0.1:1: ") != std::string::npos;
  });
  // It retries automatically: a warning, not a failure.
  EXPECT_EQ(health(), 0);
  EXPECT_THAT(words, HasSubstr("1 mail waits"));
}

TEST_F(ProcessAlarms, ADialGaugeServiceReportsAFailedLine) {
  start_gateway();
  const std::filesystem::path device = chain.folder() / "receiver";
  const Process sut =
      start("millrace-dial-gauge",
            {"--config", configured("dial_gauge.textproto",
                                    "gauge { name: 'bore' radio { line: 'r' channel: 2 } }\n"
                                    "line { name: 'r' device: '" +
                                        device.string() + "' }\n")});
  await_alarm();
  EXPECT_THAT(words, AllOf(HasSubstr("line r failed: " + device.string()), HasSubstr("plug")));
}

TEST_F(ProcessAlarms, AGatewayReportsAFullJournalUntilItCanWrite) {
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc")}));
  Process service = chain.square_root();
  gateway.emplace(chain.gateway({"--journal", (chain.folder() / "journal").string()}));
  gateway->await_error("link up");
  await_no_alarm();
  rlimit before{};
  const rlimit none{.rlim_cur = 0, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &none, &before), 0);
  gateway->await_error("the gateway accepts no new call until the journal is writable");
  // A channel's alarm takes precedence over it: its call waits.
  await("the alarm of the gateway",
        [&] { return health() != 0 && words.find("gateway on ") != std::string::npos; });
  EXPECT_THAT(words, AllOf(HasSubstr("gateway on "), HasSubstr("the journal "),
                           HasSubstr("cannot be written: ")));
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  await_no_alarm();
}

TEST_F(ProcessAlarms, AFullDiskIsTheStateOfTheChannelsAndNotAMissingService) {
  const std::string unserved = chain.counting_program("c0ffee00-0000-4000-8000-000000000009", 1);
  cnc.emplace(
      chain.cnc({"--run", Chain::program(1, "endless_calls.nc"), "--run", "2=" + unserved}));
  const Process service = chain.square_root();
  gateway.emplace(chain.gateway({"--journal", (chain.folder() / "journal").string()}));
  const auto shows = [&](const std::string& state) {
    words = output_of({"channels"});
    return words.find("  " + state + "  ") != std::string::npos;
  };
  await("a call without a service", [&] { return shows("unserved"); });
  const rlimit none{.rlim_cur = 0, .rlim_max = RLIM_INFINITY};
  ASSERT_EQ(::prlimit(gateway->pid(), RLIMIT_FSIZE, &none, nullptr), 0);
  await("the cause", [&] { return shows("journal"); });
  EXPECT_FALSE(shows("unserved")) << words;
}

TEST_F(ProcessAlarms, AGatewayNamesItsCertificatesAndWarnsBeforeTheyEnd) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  const auto key = base::openssl::Key::generate_rsa();
  configured("press.key", key.pem());
  std::filesystem::permissions(chain.folder() / "press.key", std::filesystem::perms(0640));
  const auto valid_for = [&](int days) {
    configured("press.crt",
               base::openssl::self_signed(
                   key, {.organisation = "millrace",
                         .common_name = "hall",
                         .from = now - std::chrono::days(1),
                         .until = now + std::chrono::days(days) + std::chrono::hours(1)})
                   .pem());
  };
  valid_for(10);
  chain.serve_at(9);  // this port is closed
  gateway.emplace(chain.configured_gateway(
      "machine { name: 'cnc' host: '127.0.0.1' port: @PORT@ net_id: '127.0.0.1.1.1' secure { "
      "self_signed { certificate: 'press.crt' key: 'press.key' fingerprint: '" +
      std::string(64, 'a') + "' } } }"));
  gateway->await_error(
      "the certificate \"hall\" for Secure ADS with cnc expires on .*, in 10 days: ");
  EXPECT_THAT(output_of({"doctor"}),
              AllOf(HasSubstr("warning  gateway on "), HasSubstr("cnc expires on "),
                    HasSubstr("millrace controller add-route --self-signed")));
  valid_for(50);
  gateway->signal(SIGHUP);
  await("the new certificate", [&] {
    words = output_of({"doctor", "--all"});
    return words.find("in 50 days") != std::string::npos;
  });
  EXPECT_THAT(words, AllOf(HasSubstr("fine     gateway on "), Not(HasSubstr("in 10 days"))));
}

TEST_F(ProcessAlarms, AGatewayReportsARefusedConfigurationUntilItIsRepaired) {
  const std::string good =
      "machine { name: 'cnc' host: '127.0.0.1' port: @PORT@ net_id: '127.0.0.1.1.1' }\n";
  chain.serve_at(9);  // this port is closed
  gateway.emplace(chain.configured_gateway(good));
  chain.configure(good + "policy {\n  deadline { response_state: 902 }\n}\n");
  gateway->signal(SIGHUP);
  await("the alarm", [&] {
    words = output_of({"doctor"});
    return words.find("the changed configuration is not in use") != std::string::npos;
  });
  EXPECT_THAT(words, AllOf(HasSubstr("problem  gateway on "),
                           HasSubstr("gateway.textproto:3:3: policy.deadline: it has no after_ms"),
                           HasSubstr("correct "), HasSubstr("then reload this gateway")));
  chain.configure(good);
  gateway->signal(SIGHUP);
  await("its end", [&] {
    words = output_of({"doctor"});
    return words.find("the changed configuration is not in use") == std::string::npos;
  });
}

}  // namespace
}  // namespace millrace::tests::integration
