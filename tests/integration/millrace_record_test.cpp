// millrace record and what reads its files, with the real programs.

#include <algorithm>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;

constexpr const char* square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class TheRecorder : public ChainTest {};

TEST_F(TheRecorder, RecordsEveryCallAndShowsItsTimeline) {
  const std::string file = chain.folder() / "run.mcap";
  Process recorder = chain.millrace({"record", "-o", file});
  recorder.await("^ready: ");
  Process service = chain.square_root();
  Process cnc = chain.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"});
  Process gateway = chain.gateway();
  ASSERT_EQ(cnc.wait(), 0) << cnc.error_output();
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  recorder.terminate();
  EXPECT_EQ(recorder.wait(), 0) << recorder.error_output();
  // The gateway may have seen the first call before it found the recorder.
  EXPECT_THAT(
      recorder.error_output(),
      AllOf(HasSubstr("and 0 lost;"), ContainsRegex("millrace: (199|200) calls are complete\n")));

  const std::string channels = run({"recording", "info", "--json", file}).output();
  EXPECT_EQ(exit_code, 0);
  for (const char* kind : {"request", "reply", "event"}) {
    EXPECT_THAT(channels, HasSubstr(std::string("machine/cnc/1/") + kind +
                                    "\",\"schema\":\"millrace.recording."));
  }
  const std::string requests = run({"recording", "cat", "--kind", "request", file}).output();
  EXPECT_EQ(std::count(requests.begin(), requests.end(), '\n'), 200);
  const std::string replies = run({"recording", "cat", "--kind", "reply", file}).output();
  EXPECT_EQ(std::count(replies.begin(), replies.end(), '\n'), 200);
  EXPECT_THAT(run({"recording", "info", "--hops", file}).output(), HasSubstr("write back"));
}

TEST_F(TheRecorder, ChecksThatItCanRecordBeforeItIsReady) {
  const std::string file = chain.folder() / "run.mcap";
  std::ofstream(file) << "mine";
  const std::string nowhere = chain.folder() / "none/run.mcap";
  for (const std::string& output : {file, nowhere}) {
    Process sut = chain.millrace({"record", "-o", output});
    EXPECT_EQ(sut.wait(), 2);
    EXPECT_EQ(sut.output(), "");
    EXPECT_THAT(sut.error_output(), HasSubstr("-o " + output + ": "));
  }
}

TEST_F(TheRecorder, ReportsThatNothingWasReceived) {
  Process sut = chain.millrace({"record", "-o", (chain.folder() / "run.mcap").string()});
  sut.await("^ready: ");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.error_output(), HasSubstr("nothing was received on fabric"));
}

TEST_F(TheRecorder, SavesWhatAKilledRecorderHadWritten) {
  const std::string file = chain.folder() / "run.mcap";
  Process recorder = chain.millrace({"record", "-o", file, "--sync", "call"});
  recorder.await("^ready: ");
  Process service = chain.square_root();
  Process cnc = chain.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"});
  Process gateway = chain.gateway();
  ASSERT_EQ(cnc.wait(), 0) << cnc.error_output();
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  recorder.kill();

  Process next = chain.millrace({"record", "-o", file});
  next.await("^ready: ");
  EXPECT_THAT(next.error_output(), HasSubstr("was not closed"));
  next.terminate();
  EXPECT_EQ(next.wait(), 0);
  run({"recording", "info", (chain.folder() / "run.repaired.mcap").string()});
  EXPECT_EQ(exit_code, 0);
}

TEST_F(TheRecorder, RecordsAgainAfterEachKill) {
  // Typed with a relative path, in the folder.
  const auto record = [&](const std::string& file) {
    Flags command{"/usr/bin/env", "-C", chain.folder().string()};
    const Flags rest = chain.command({"record", "-o", file});
    command.insert(command.end(), rest.begin(), rest.end());
    return Process(command);
  };
  for (int kill = 0; kill < 3; ++kill) {
    Process recorder = record("run.mcap");
    recorder.await("^ready: ");
    recorder.kill();
  }
  std::ofstream(chain.folder() / "run.mcap.part") << "no recording at all";
  Process refused = record("./run.mcap");
  EXPECT_EQ(refused.wait(), 2) << refused.error_output();
  EXPECT_THAT(refused.error_output(),
              HasSubstr("run.mcap.part was left by an earlier recording and cannot be repaired"));
  EXPECT_TRUE(std::filesystem::exists(chain.folder() / "run.repaired.mcap"));
  EXPECT_TRUE(std::filesystem::exists(chain.folder() / "run.repaired-2.mcap"));
}

TEST_F(TheRecorder, ContinuesRecordingWhenAFullDiskHasRoomAgain) {
  const std::string disk = (chain.folder() / "disk").string();
  std::filesystem::create_directory(disk);
  // A disk that only this process sees, and the test through its /proc.
  Flags command{"/usr/bin/unshare",
                "--mount",
                "--map-root-user",
                "/bin/sh",
                "-c",
                "mount -t tmpfs -o size=2m tmpfs " + disk + R"( && exec "$@")",
                "sh"};
  const Flags rest = chain.command(
      {"record", "-o", disk + "/run.mcap", "--rotate-time", "24h", "--min-free", "64KiB"});
  command.insert(command.end(), rest.begin(), rest.end());
  Process sut(command);
  sut.await("^ready: ");
  const std::filesystem::path seen = "/proc/" + std::to_string(sut.pid()) + "/root" + disk;
  const Process service = chain.square_root();
  const auto call = [&] { run({"call", "--timeout", "10s", square_root, "4"}); };
  call();
  {
    std::ofstream filler(seen / "filler", std::ios::binary);
    filler << std::string(std::size_t{4} << 20U, 'x') << std::flush;
    ASSERT_FALSE(filler) << "the disk is not full";
  }
  call();
  sut.await_error("nothing is recorded until there is room");
  std::filesystem::remove(seen / "filler");
  sut.await_error("there is room on the disk again");
  call();
  // The disk exists as long as it is open.
  const base::posix::Fd open(::open(seen.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  ASSERT_TRUE(open);
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  run({"recording", "info",
       "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(open.get()) +
           "/run-0001.mcap"});
  EXPECT_EQ(exit_code, 0);
}

}  // namespace
}  // namespace millrace::tests::integration
