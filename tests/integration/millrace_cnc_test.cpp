// The program millrace-cnc from a user's view: flags, ready line, exit codes, output.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/client.hpp"
#include "cnc/variables/service_interface.hpp"
#include "tests/support/await.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::tests {
namespace {

using cnc::variables::ServiceInterface;
using cnc::variables::ServiceValue;
using cnc::variables::ServiceVariable;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

std::string program(const std::string& name) {
  return test_data("nc/cnc/" + name);
}

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

class MillraceCnc : public testing::Test {
 protected:
  /// On a free port, with its own folder.
  Process start(std::vector<std::string> flags) {
    std::vector<std::string> command{binary("millrace-cnc"), "--listen", "127.0.0.1:0", "--dir",
                                     folder_.path().string()};
    command.insert(command.end(), flags.begin(), flags.end());
    return Process(std::move(command));
  }

  TemporaryFolder folder_;
};

TEST_F(MillraceCnc, NamesItsRealAddressWhenItIsReady) {
  Process sut = start({"--channels", "2", "--net-id", "10.0.0.5.1.1"});
  const auto ready = sut.await("^ready: virtual CNC 10.0.0.5.1.1 on 127.0.0.1:(\\d+), 2 channels$");
  EXPECT_NE(ready.at(1), "0");
}

TEST_F(MillraceCnc, EndsCleanlyOnSigterm) {
  Process sut = start({});
  sut.await("^ready: ");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
}

TEST_F(MillraceCnc, EndsCleanlyOnSigint) {
  Process sut = start({"--run", "1=" + program("endless.nc")});
  sut.await("^ready: ");
  sut.signal(SIGINT);
  EXPECT_EQ(sut.wait(), 0);
}

TEST_F(MillraceCnc, PrintsMessagesAsUtf8WithTheirChannel) {
  Process sut =
      start({"--channels", "2", "--run", "2=" + program("cp1252.nc"), "--exit-when-idle"});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), HasSubstr("\n[ch2] caf\u00e9\n"));
}

TEST_F(MillraceCnc, AbortsAProgramWhoseReportFileIsRefused) {
  const auto nc = folder_.path() / "report.nc";
  std::ofstream(nc) << "N10 #FILE NAME [MSG=\".profile\"]\nN20 #MSG SAVE [\"evil\"]\n"
                       "N30 G04 X1\nN40 #FLUSH WAIT\nN50 #MSG [\"went on\"]\nN60 M30\n";
  Process sut = start({"--channels", "2", "--run", "2=" + nc.string(), "--exit-when-idle"});
  EXPECT_EQ(sut.wait(), 1) << sut.error_output();
  EXPECT_THAT(sut.error_output(),
              ContainsRegex("channel 2: the program was aborted: .*report file .profile"));
  EXPECT_THAT(sut.output(), testing::Not(HasSubstr("went on")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / ".profile"));
}

TEST_F(MillraceCnc, AppendsSavedMessagesToTheReportFile) {
  for (int i = 0; i < 2; ++i) {
    Process sut = start({"--run", "1=" + program("message.nc"), "--exit-when-idle"});
    ASSERT_EQ(sut.wait(), 0) << sut.error_output();
    EXPECT_THAT(sut.output(), HasSubstr("\n[ch1] hello 7\n"));
  }
  const std::string stamp = "....-..-.. ..:..:..\\.... ";
  EXPECT_THAT(text_of(folder_.path() / "message.txt"),
              MatchesRegex(stamp + "saved\nplain\n" + stamp + "saved\nplain\n"));
}

TEST_F(MillraceCnc, EndsOnlyWhenEveryProgramHas) {
  Process sut = start({"--channels", "2", "--run", "1=" + program("message.nc"), "--run",
                       "2=" + program("endless.nc"), "--exit-when-idle"});
  sut.await("^\\[ch1\\] hello 7$");
  EXPECT_TRUE(sut.running());
  sut.terminate();
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(sut.error_output(), HasSubstr("ended by a signal while a program was still running"));
}

TEST_F(MillraceCnc, ReportsWhereAndWhyAProgramWasAborted) {
  Process sut = start({"--run", "1=" + program("too_long.nc"), "--exit-when-idle"});
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(sut.error_output(), HasSubstr("too_long.nc:2:1: N10: error 21462: "));
}

TEST_F(MillraceCnc, LabelsAWarningAsOne) {
  Process sut = start({"--run", "1=" + program("warns.nc"), "--exit-when-idle"});
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(sut.error_output(), HasSubstr("channel 1: "));
  EXPECT_THAT(sut.error_output(), HasSubstr("warns.nc:2:1: N10: warning: "));
}

TEST_F(MillraceCnc, ReportsEveryMistakeOfAProgramItCannotStart) {
  Process sut = start({"--run", "1=" + program("mistakes.nc"), "--exit-when-idle"});
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(sut.error_output(), HasSubstr("mistakes.nc:1:1: "));
  EXPECT_THAT(sut.error_output(), HasSubstr("mistakes.nc:2:11: N20: error 20721: "));
}

TEST_F(MillraceCnc, ChecksProgramsWithoutRunningThem) {
  Process good = start({"--check", program("message.nc")});
  EXPECT_EQ(good.wait(), 0);
  EXPECT_EQ(good.output(), "");
  Process bad = start({"--check", program("message.nc"), program("mistakes.nc")});
  EXPECT_EQ(bad.wait(), 1);
  EXPECT_THAT(bad.output(), HasSubstr("mistakes.nc:1:1: "));
  EXPECT_THAT(bad.output(), HasSubstr("mistakes.nc:2:11: N20: error 20721: "));
}

// An ADS client answers the call of square_root.nc in place of a service.
TEST_F(MillraceCnc, LetsAClientAnswerTheCallOfAProgram) {
  Process sut = start({"--run", "1=" + test_data("nc/square_root.nc").string(), "--speed", "0",
                       "--exit-when-idle", "--timings"});
  const std::string port = sut.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);

  boost::asio::io_context io;
  cnc::ads::Client client(
      io.get_executor(),
      {.tcp_port = static_cast<std::uint16_t>(std::stoi(port)), .target = {{127, 0, 0, 1, 1, 1}}});
  ASSERT_TRUE(wait_for(io, client.connect()));
  ServiceInterface service(client, 1);
  await("the program's call", [&] {
    return wait_for(io, service.read(ServiceVariable::request_state)) != ServiceValue{0U};
  });
  EXPECT_EQ(wait_for(io, service.read(ServiceVariable::uuid)),
            ServiceValue{"560AACBF-6335-44a9-895A-8B27F3ED5E47"});
  EXPECT_EQ(wait_for(io, service.read(ServiceVariable::request)), ServiceValue{"3"});
  ASSERT_TRUE(wait_for(io, service.write(ServiceVariable::response, "1.732")));
  ASSERT_TRUE(wait_for(io, service.write(ServiceVariable::request_state, 0U)));
  ASSERT_TRUE(wait_for(io, service.write(ServiceVariable::response_state, 1U)));

  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), HasSubstr("\n[ch1] response = 1.732\n"));
  EXPECT_THAT(sut.output(),
              ContainsRegex("\n\\[ch1\\] call 1: 560AACBF-6335-44a9-895A-8B27F3ED5E47: "
                            "[0-9]+\\.[0-9][0-9] ms\n$"));
}

TEST_F(MillraceCnc, ClosesTheConnectionOfAClientWithoutARoute) {
  const auto config = folder_.path() / "cnc.textproto";
  std::ofstream(config) << "connections { route: \"10.0.0.9.1.1\" }";
  Process sut = start({"--config", config.string()});
  const std::string port = sut.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);

  boost::asio::io_context io;
  cnc::ads::Client client(
      io.get_executor(),
      {.tcp_port = static_cast<std::uint16_t>(std::stoi(port)), .target = {{127, 0, 0, 1, 1, 1}}});
  EXPECT_FALSE(wait_for(io, client.connect()));
}

TEST_F(MillraceCnc, StartsAProgramOfItsFolderOverAds) {
  std::ofstream(folder_.path() / "demo.nc") << "N10 #MSG [\"started\"]\nN20 M30\n";
  Process sut = start({});
  const std::string port = sut.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);

  boost::asio::io_context io;
  cnc::ads::Client client(
      io.get_executor(),
      {.tcp_port = static_cast<std::uint16_t>(std::stoi(port)), .target = {{127, 0, 0, 1, 1, 1}}});
  ASSERT_TRUE(wait_for(io, client.connect()));
  const auto command = [&](std::uint32_t offset, cnc::ads::Bytes data) {
    constexpr std::uint16_t com_port = 553;
    constexpr std::uint32_t channel_1 = 0x120101;
    return wait_for(io, client.write(com_port, {channel_1, offset}, std::move(data)));
  };
  ASSERT_TRUE(command(0x104, {2, 0, 0, 0}));
  ASSERT_TRUE(command(0x108, {'d', 'e', 'm', 'o', '.', 'n', 'c', 0}));
  ASSERT_TRUE(command(0x105, {3, 0, 0, 0}));
  ASSERT_TRUE(command(0x105, {4, 0, 0, 0}));
  sut.await("^\\[ch1\\] started$");
}

/// Invalid flags, and what the message must contain.
struct WrongUse {
  std::vector<std::string> flags;
  std::string message;

  friend std::ostream& operator<<(std::ostream& out, const WrongUse& use) {
    for (const std::string& flag : use.flags) {
      out << std::filesystem::path(flag).filename().string() << ' ';
    }
    return out;
  }
};

class MillraceCncUsage : public testing::TestWithParam<WrongUse> {};

TEST_P(MillraceCncUsage, IsRefusedWithAReason) {
  const TemporaryFolder folder;
  write_bad_configurations("cnc", folder.path());
  std::vector<std::string> command{binary("millrace-cnc")};
  for (const std::string& flag : GetParam().flags) {
    const bool is_file = flag.ends_with(".textproto");
    command.push_back(is_file ? (folder.path() / flag).string() : flag);
  }
  Process sut(std::move(command));
  EXPECT_EQ(sut.wait(), 2);
  EXPECT_THAT(sut.error_output(), StartsWith("millrace-cnc: "));
  EXPECT_THAT(sut.error_output(), HasSubstr(GetParam().message));
  EXPECT_EQ(sut.output(), "");
}

INSTANTIATE_TEST_SUITE_P(
    Wrong, MillraceCncUsage,
    testing::Values(
        WrongUse{{"--listen", "127.0.0.1"}, "--listen 127.0.0.1: expected ADDRESS:PORT"},
        WrongUse{{"--listen", "127.0.0.1:99999"},
                 "--listen 127.0.0.1:99999: expected ADDRESS:PORT"},
        WrongUse{{"--net-id", "1.2.3"}, "--net-id 1.2.3: expected six numbers"},
        WrongUse{{"--channels", "0"}, "--channels"}, WrongUse{{"--channels", "256"}, "--channels"},
        WrongUse{{"--run", "demo.nc"}, "--run demo.nc: expected CHANNEL=FILE"},
        WrongUse{{"--run", "2=demo.nc"}, "there is no channel 2"},
        WrongUse{{"--run", "1=no_such_file.nc"}, "no_such_file.nc cannot be read"},
        WrongUse{{"--run", "1=" + program("message.nc"), "--run", "1=" + program("endless.nc")},
                 "channel 1 has a program already"},
        WrongUse{{"--exit-when-idle"}, "--exit-when-idle: no program is run"},
        WrongUse{{"--speed", "-1"}, "--speed: -1 is not allowed; expected 0 or a greater number"},
        WrongUse{{"--speed", "0.0001"}, "--speed 0.0001: expected 0 or at least 0.001"},
        WrongUse{{"--dir", "/no/such/folder"}, "--dir"},
        WrongUse{{"--config", "/no/such/file"}, "--config"},
        WrongUse{{"--config", "no_channels.cnc.textproto"},
                 "no_channels.cnc.textproto:1:1: channels: 0; expected 1 to 255"},
        WrongUse{{"--config", "two_axes_of_one_name.cnc.textproto"},
                 "two_axes_of_one_name.cnc.textproto:2:8: axis.name: \"X\" occurs twice"},
        WrongUse{{"--config", "misspelt_switch.cnc.textproto"},
                 "misspelt_switch.cnc.textproto:2:39: "},
        WrongUse{{"--no-such-flag"}, "--no-such-flag"}));

}  // namespace
}  // namespace millrace::tests
