// millrace-dial-gauge as a process, called over the fabric; a pty replaces the receiver.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

using testing::HasSubstr;

const std::string uuid = "E6F15204-3A7C-4686-9BC3-1400D062127C";

class DialGauge : public testing::Test {
 protected:
  Process start(const std::string& configuration) {
    std::ofstream(config) << configuration;
    Process process({binary("millrace-dial-gauge"), "--config", config.string(), "--domain",
                     std::to_string(domain.number())});
    process.await("^ready: ");
    return process;
  }
  static void send(const base::posix::Fd& line, const std::string& bytes) {
    ASSERT_EQ(::write(line.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  fabric::Reply call(const std::string& text) { return caller.call(uuid, text); }

  TemporaryFolder folder;
  std::filesystem::path config = folder.path() / "dial_gauge.textproto";
  Domain domain;
  Caller caller{domain.number()};
};

TEST_F(DialGauge, AnswersFromASimulatedGauge) {
  const Process sut = start("gauge { name: 'depth' simulated { nominal_mm: 12.345 } }");
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(call("READ depth").text, "12.345 mm");
  EXPECT_EQ(call("LIST").text, "depth");
  const fabric::Reply wrong = call("READ /etc/passwd");
  EXPECT_EQ(wrong.state, 10U);
  EXPECT_THAT(wrong.text, HasSubstr("ERROR: no gauge can be called '/etc/passwd'"));
}

TEST_F(DialGauge, AnswersFromAReceiverOnASerialLine) {
  const base::posix::Fd master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  ::grantpt(master.get());
  ::unlockpt(master.get());
  Process sut =
      start("gauge { name: 'bore' radio { line: 'r' channel: 2 } }\nline { name: 'r' device: '" +
            std::string(::ptsname(master.get())) + "' }");
  sut.await_error("line r is open");
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(call("READ bore").state, 13U);
  send(master, "DT10002+0000xx12.34M\r");
  sut.await_error("1 broken frames so far");
  EXPECT_EQ(call("READ bore").state, 13U);
  send(master, "DT10002+00000012.34M\r");
  // The value travels through the line and another process.
  fabric::Reply reply = call("READ bore");
  while (reply.state == 13) {
    reply = call("READ bore");
  }
  EXPECT_EQ(reply.text, "12.340 mm");
}

TEST_F(DialGauge, KeepsItsZeroPointsAcrossARestart) {
  const std::string configuration =
      "gauge { name: 'depth' simulated { nominal_mm: 5 nominal_mm: 7 } }";
  {
    Process first = start(configuration);
    ASSERT_TRUE(caller.await_instance(uuid));
    EXPECT_EQ(call("ZERO depth").text, "0.000 mm");
    first.kill();
  }
  ASSERT_TRUE(caller.await_no_instance(uuid));
  const Process second = start(configuration);
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(call("READ depth").text, "0.000 mm");
  EXPECT_EQ(call("READ depth").text, "2.000 mm");
}

TEST_F(DialGauge, ServesASimulatedGaugeWithoutAConfiguration) {
  Process sut({binary("millrace-dial-gauge"), "--domain", std::to_string(domain.number())});
  sut.await("^ready: dial_gauge serves e6f15204-3a7c-4686-9bc3-1400d062127c");
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(call("STATUS G1").state, 1U);
}

TEST_F(DialGauge, RefusesToStartOnAZeroFileItCannotRead) {
  std::ofstream(folder.path() / "dial_gauge.zeros") << "zero { gauge: ";
  std::ofstream(config) << "gauge { name: 'depth' simulated { nominal_mm: 5 } }";
  Process sut({binary("millrace-dial-gauge"), "--config", config.string()});
  EXPECT_EQ(sut.wait(), 2);
  EXPECT_THAT(sut.error_output(), HasSubstr("dial_gauge.zeros:1:"));
}

}  // namespace
}  // namespace millrace::tests
