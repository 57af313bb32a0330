// The states of NC programs, from the virtual CNC to the page, the recorder and the archive.
#include <fstream>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/client.hpp"
#include "cnc/variables/objects.hpp"
#include "cnc/variables/value.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::tests::integration {
namespace {

using cnc::ads::Bytes;
using cnc::ads::ByteWriter;
using testing::HasSubstr;

/// The operator at the panel of channel 1: commands modes and states as an ADS client does.
class Panel {
 public:
  explicit Panel(std::uint16_t port) : client_(io_.get_executor(), options(port)) {
    EXPECT_TRUE(wait_for(io_, client_.connect()));
  }

  void start(const std::string& program) {
    write(0x104, number(2));
    write(0x108, *cnc::variables::encode_text(program));
    write(0x105, number(3));
    write(0x105, number(4));
  }
  void go_on() { write(0x105, number(4)); }
  void standby() { write(0x104, number(1)); }

 private:
  static cnc::ads::ClientOptions options(std::uint16_t port) {
    cnc::ads::ClientOptions options;
    options.tcp_port = port;
    options.target = {{127, 0, 0, 1, 1, 1}};
    return options;
  }
  static Bytes number(std::uint32_t value) { return ByteWriter().u32(value).take(); }
  void write(std::uint32_t offset, const Bytes& data) {
    const auto written =
        wait_for(io_, client_.write(cnc::variables::com_port, {0x120101, offset}, data));
    EXPECT_TRUE(written) << cnc::ads::describe(written.error());
  }

  boost::asio::io_context io_;
  cnc::ads::Client client_;
};

class Programs : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::ofstream(sut.folder() / name) << text;
  }
  Process gateway() {
    return sut.configured_gateway(
        "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
        "programs { period_ms: 20 name: \"mc_program_name_r\" error: \"mc_error_id_r\" counter: "
        "\"V.E.PARTS\" } data { name: \"state\" variable: \"state\" period_ms: 20 } }\n");
  }
  Process cnc(const std::string& more = "") {
    const std::string config = (sut.folder() / "cnc.textproto").string();
    std::ofstream(config) << "external_variable { name: \"PARTS\" type: UNS32 }\n" << more;
    return sut.cnc({"--config", config});
  }
  /// So that the first start is seen, too.
  void await_idle() {
    Process data = sut.millrace({"data", "--follow"});
    data.await("state  state=2");
  }

  Chain sut;
};

TEST_F(Programs, ArePublishedWithNameErrorDurationAndParts) {
  write("good.nc", "%good\nV.E.PARTS = 17\n#FLUSH WAIT\n#TIME 0.3\nM30\n");
  write("bad.nc", "%bad\n#FLUSH WAIT\n#TIME 0.3\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n");
  write("halt.nc", "%halt\n#TIME 0.2\nM00\n#TIME 0.2\nM30\n");
  write("stop.nc", "%stop\n#TIME 0.2\nM00\nM30\n");
  Process controller = cnc();
  Process serving = gateway();
  Process watch = sut.millrace({"programs", "cnc", "--follow"});
  await_idle();
  Panel panel(sut.port());

  panel.start("good.nc");
  watch.await("program     cnc/1  started  \"[^\"]*good\\.nc\"");
  watch.await("program     cnc/1  ended  \"[^\"]*good\\.nc\"  after \\d+ ms  17 parts  automatic");
  serving.await_error("cnc/1: program .*good\\.nc ended");

  panel.start("halt.nc");
  watch.await("on hold  \"[^\"]*halt\\.nc\"");
  panel.go_on();
  watch.await("resumed  \"[^\"]*halt\\.nc\"");
  watch.await("ended  \"[^\"]*halt\\.nc\"");

  panel.start("stop.nc");
  watch.await("on hold  \"[^\"]*stop\\.nc\"");
  panel.standby();
  watch.await("reset  \"[^\"]*stop\\.nc\"");

  panel.start("bad.nc");
  watch.await("aborted  \"[^\"]*bad\\.nc\"  error \\d+  after");

  Process last = sut.millrace({"programs", "--json"});
  ASSERT_EQ(last.wait(), 0) << last.error_output();
  EXPECT_THAT(last.output(), HasSubstr(R"("event":"aborted")"));
}

TEST_F(Programs, AreRecordedAndArchived) {
  write("good.nc", "%good\nV.E.PARTS = 17\n#FLUSH WAIT\n#TIME 0.2\nM30\n");
  const std::string file = (sut.folder() / "run.mcap").string();
  Process record = sut.millrace({"record", "-o", file});
  record.await("^ready: ");
  const std::string config = (sut.folder() / "archiver.textproto").string();
  std::ofstream(config) << "folder: \"archive\"\n";
  Process archiver(
      {binary("millrace-archiver"), "--domain", std::to_string(sut.domain()), "--config", config});
  archiver.await("^ready: ");
  Process controller = cnc();
  Process serving = gateway();
  await_idle();
  Process watch = sut.millrace({"programs", "--follow"});

  Panel(sut.port()).start("good.nc");
  watch.await("ended  \"[^\"]*good\\.nc\"");

  await("the end of the program in the recording", [&] {
    // While it is being written; it may not exist yet.
    Process cat = sut.millrace({"recording", "cat", file + ".part", "--kind", "program"});
    cat.wait();
    return cat.output().find("ended") != std::string::npos;
  });
  record.terminate();
  ASSERT_EQ(record.wait(), 0) << record.error_output();
  Process cat = sut.millrace({"recording", "cat", file, "--kind", "program"});
  ASSERT_EQ(cat.wait(), 0) << cat.error_output();
  EXPECT_THAT(cat.output(), testing::ContainsRegex("ended  \"[^\"]*good.nc\""));
  std::string archived;
  await("the end of the program in the archive", [&] {
    Process query({binary("millrace-archiver"), "query", "--folder",
                   (sut.folder() / "archive").string(), "--kind", "program"});
    EXPECT_EQ(query.wait(), 0) << query.error_output();
    archived = query.output();
    return archived.find("ended") != std::string::npos;
  });
  EXPECT_THAT(archived, testing::ContainsRegex("\tcnc\t1\tended\t[^\t]*good.nc\t0."));

  Process again = sut.millrace({"replay", "--data", "--fast", "--channel", "cnc=yesterday", file});
  watch.await("yesterday/1  started  \"[^\"]*good\\.nc\".*\\(replayed\\)");
  watch.await("yesterday/1  ended  \"[^\"]*good\\.nc\".*\\(replayed\\)");
  EXPECT_EQ(again.wait(), 0) << again.error_output();
}

TEST_F(Programs, ArePublishedWithoutNamesWhereTheControllerHasNone) {
  write("good.nc", "%good\n#TIME 0.2\nM30\n");
  Process controller =
      cnc("answers { program_objects: false } programs { ready_after_end: true }\n");
  Process serving = gateway();
  serving.await_error("cnc/1: programs: mc_program_name_r, mc_error_id_r cannot be read: 0x704");
  Process watch = sut.millrace({"programs", "--follow"});
  await_idle();
  Panel(sut.port()).start("good.nc");
  watch.await("started  0 parts  automatic");
  watch.await("ended  after \\d+ ms  0 parts  automatic");
}

}  // namespace
}  // namespace millrace::tests::integration
