// LCM's own logger and player, in the group of millrace-lcm.
#include <csignal>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "tests/integration/lcm/lcm_program.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;

/// The log of LCM's own logger for a group.
class LcmLog : public Lcm {
 protected:
  [[nodiscard]] Process logger(const std::string& into, const std::string& group) const {
    // It prints nothing when it is ready; its file shows what it has received.
    return Process({"/usr/bin/lcm-logger", "--flush-interval=10", "--lcm-url=" + group, into});
  }
  /// Waits until what was published is in the log, then ends the logger properly.
  static void await_events(const std::filesystem::path& log, const std::string& what,
                           std::size_t many) {
    await("the log", [&] { return count(log, what) >= many; });
  }
  static std::size_t count(const std::filesystem::path& log, const std::string& what) {
    std::ifstream in(log, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    std::size_t found = 0;
    for (std::size_t at = 0; (at = bytes.find(what, at)) != std::string::npos; ++at) {
      ++found;
    }
    return found;
  }
  static void end(Process& logger) {
    logger.signal(SIGINT);
    logger.wait();
  }

  const std::string here = "udpm://239.255.76.67:7667?ttl=0";
  const std::string elsewhere = "udpm://239.255.76.68:7668?ttl=0";
  const std::filesystem::path file = chain.folder() / "run.lcm";
  const std::filesystem::path again = chain.folder() / "again.lcm";
};

TEST_F(LcmLog, OfTheMirrorReplays) {
  start("", {"--mirror"});
  Process keeps = logger(file, here);
  // A plain service, not an LCM one: the mirror shows the fabric.
  const Process service = chain.square_root();
  const std::string of = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const LcmProgram flowing(uuid);
  await_events(file, "MILLRACE_PRESENCE", 1);
  // This caller stays and uses one channel per call, so a mirror that discovers it late still gets
  // all three requests.
  ASSERT_TRUE(caller().await_instance(of));
  std::uint16_t channel = 0;
  for (const char* number : {"2", "9", "x"}) {
    static_cast<void>(caller().call(of, number, ++channel));
  }
  await_events(file, "MILLRACE_MIRROR.request", 3);
  await_events(file, "MILLRACE_MIRROR.reply", 3);
  end(keeps);

  Process replay = chain.millrace({"replay", "--to-services", "--verify", file.string()});
  EXPECT_EQ(replay.wait(), 0) << replay.output() << replay.error_output();
  EXPECT_THAT(replay.output(), HasSubstr("3 calls"));

  // LCM's player sends the same messages again.
  Process hears = logger(again, elsewhere);
  await("the logger", [&] {
    Process player(
        {"/usr/bin/lcm-logplayer", "--speed=100", "--lcm-url=" + elsewhere, file.string()});
    player.wait();
    return count(again, "MILLRACE_MIRROR.reply") >= 3;
  });
  end(hears);
  Process second = chain.millrace({"replay", "--to-services", "--verify", again.string()});
  EXPECT_EQ(second.wait(), 0) << second.output() << second.error_output();
}

TEST_F(LcmLog, OfTheMirrorHasNoTextOfAServiceWhoseTextsAreWithheld) {
  start("mirror { without_text: '560AACBF-6335-44a9-895A-8B27F3ED5E47' }");
  Process keeps = logger(file, here);
  const Process service = chain.square_root();
  const LcmProgram flowing(uuid);
  await_events(file, "MILLRACE_PRESENCE", 1);
  Process caller = call("560aacbf-6335-44a9-895a-8b27f3ed5e47", "15241578750190521");
  EXPECT_EQ(caller.wait(), 0);
  await_events(file, "MILLRACE_MIRROR.reply", 1);
  end(keeps);
  EXPECT_EQ(count(file, "15241578750190521"), 0U);
  EXPECT_EQ(count(file, "123456789.0"), 0U);
  Process replay = chain.millrace({"replay", "--to-services", file.string()});
  EXPECT_EQ(replay.wait(), 2);
  EXPECT_THAT(replay.error_output(), HasSubstr("its request text is not in the recording"));
}

TEST_F(LcmLog, PlayedIntoTheGroupRegistersNoProgramAndAnswersNothing) {
  start();
  Process keeps = logger(file, here);
  {
    Process program({MILLRACE_LCM_SQUARE_ROOT});
    ASSERT_TRUE(caller().await_instance(root_uuid));
    caller().call(root_uuid, "2");
    await_events(file, "MILLRACE_PRESENCE", 6);
  }
  end(keeps);
  ASSERT_TRUE(caller().await_no_instance(root_uuid));
  Process player({"/usr/bin/lcm-logplayer", "--lcm-url=" + here, file.string()});
  sut->await_error("the clocks differ, or a log is played; ignored");
  player.wait();
  EXPECT_TRUE(caller().await_no_instance(root_uuid));
}

}  // namespace
}  // namespace millrace::tests::integration
