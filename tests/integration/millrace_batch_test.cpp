// millrace-batch as a process, called over the fabric.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/await.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

const std::string echo_uuid = "1b671a64-40d5-491e-99b0-da01ff1f3341";
const std::string exit_uuid = "5e5b4a7f-0f2e-4f0a-9f5c-2f7d0c1a6b11";

fs::path program(const std::string& name) {
  return test_data("batch/programs") / name;
}

class BatchFolder : public testing::Test {
 protected:
  BatchFolder() { fs::create_directory(programs); }

  void install(const std::string& name) { fs::copy_file(program(name), programs / name); }
  void configure(const std::string& scripts) {
    const fs::path part = folder.path() / "part";
    std::ofstream(part) << "folder: 'programs'\n" << scripts;
    fs::rename(part, config);
  }
  static std::string script(const std::string& uuid, const std::string& program,
                            const std::string& more = {}) {
    return "script { uuid: '" + uuid + "' program: '" + program + "' " + more + " }\n";
  }
  void start() {
    sut.emplace(std::vector<std::string>{binary("millrace-batch"), "--config", config.string(),
                                         "--domain", std::to_string(domain.number())});
    sut->await("^ready: ");
  }

  TemporaryFolder folder;
  fs::path programs = folder.path() / "programs";
  fs::path config = folder.path() / "batch.textproto";
  Domain domain;
  Caller caller{domain.number()};
  std::optional<Process> sut;
};

TEST_F(BatchFolder, AnswersWithTheOutputAndTheExitCode) {
  install("say_request.sh");
  install("exit_with.sh");
  configure(script(echo_uuid, "say_request.sh") + script(exit_uuid, "exit_with.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  ASSERT_TRUE(caller.await_instance(exit_uuid));

  const fabric::Reply echo = caller.call(echo_uuid, "Ma\xDF 1; $(reboot)");
  EXPECT_EQ(echo.text, "[Ma\xDF 1; $(reboot)] [Ma\xDF 1; $(reboot)]");
  EXPECT_EQ(echo.state, 1U);

  const fabric::Reply failed = caller.call(exit_uuid, "3 no part");
  EXPECT_EQ(failed.text, "no part");
  EXPECT_EQ(failed.state, 103U);

  const fabric::Reply empty = caller.call(echo_uuid, "");
  EXPECT_EQ(empty.text, "ERROR: the request is empty");
  EXPECT_EQ(empty.state, 10U);
}

TEST_F(BatchFolder, RegistersWithItsDeliveryPolicy) {
  install("say_request.sh");
  configure(script(echo_uuid, "say_request.sh"));
  start();
  EXPECT_TRUE(caller.await_instance(echo_uuid));
  EXPECT_EQ(caller.identity(echo_uuid).delivery, fabric::Delivery::at_most_once);
}

TEST_F(BatchFolder, ServesAProgramOnceItIsThere) {
  configure(script(echo_uuid, "say_request.sh"));
  start();
  sut->await_error("say_request.sh is missing or not executable");
  install("say_request.sh");
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  fs::remove(programs / "say_request.sh");
  EXPECT_TRUE(caller.await_no_instance(echo_uuid));
}

TEST_F(BatchFolder, HasAnAlarmUntilItsScriptCanBeRun) {
  const auto is_reported = [&] {
    Process status(
        {binary("millrace"), "status", "--json", "--domain", std::to_string(domain.number())});
    status.wait();
    return status.output().find("\"script_unusable\"") != std::string::npos;
  };
  install("say_request.sh");
  fs::permissions(programs / "say_request.sh", fs::perms::owner_read);
  configure(script(echo_uuid, "say_request.sh"));
  start();
  await("its alarm", is_reported);
  fs::permissions(programs / "say_request.sh", fs::perms::owner_all);
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  await("the end of its alarm", [&] { return !is_reported(); });
}

TEST_F(BatchFolder, TheCheckWarnsOfAProgramThatCannotRun) {
  install("say_request.sh");
  configure(script(echo_uuid, "say_request.sh"));
  Process good({binary("millrace-batch"), "--check", "--config", config.string()});
  EXPECT_EQ(good.wait(), 0);
  EXPECT_EQ(good.output(), config.string() + " is good: 1 script\n");
  EXPECT_EQ(good.error_output(), "");

  std::ofstream(programs / "not_executable.sh") << "#!/bin/sh\n";
  configure(script(echo_uuid, "not_executable.sh") + script(exit_uuid, "absent.sh"));
  Process absent({binary("millrace-batch"), "--check", "--config", config.string()});
  EXPECT_EQ(absent.wait(), 0) << "the check may run on another host";
  EXPECT_EQ(absent.output(), config.string() + " is good: 2 scripts, 2 not usable here\n");
  for (const auto& [name, uuid] :
       {std::pair("not_executable.sh", echo_uuid), std::pair("absent.sh", exit_uuid)}) {
    EXPECT_THAT(
        absent.error_output(),
        HasSubstr("warning: " + config.string() + ": " + name + ": " + (programs / name).string() +
                  " is missing or not executable; " + uuid + " is not served\n"));
  }
}

TEST_F(BatchFolder, AppliesAChangedConfigurationWithoutARestart) {
  install("say_request.sh");
  install("exit_with.sh");
  configure(script(echo_uuid, "say_request.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  configure(script(exit_uuid, "exit_with.sh"));
  EXPECT_TRUE(caller.await_instance(exit_uuid));
  EXPECT_TRUE(caller.await_no_instance(echo_uuid));
}

// A regression: the process stayed, without a service, and no supervisor restarted it.
TEST_F(BatchFolder, EndsWhenAnOperatorHasDrainedItsLastService) {
  install("say_request.sh");
  install("exit_with.sh");
  configure(script(echo_uuid, "say_request.sh") + script(exit_uuid, "exit_with.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  ASSERT_TRUE(caller.await_instance(exit_uuid));
  const auto drain = [&](const std::string& uuid) {
    Process command(
        {binary("millrace"), "drain", uuid, "--domain", std::to_string(domain.number())});
    EXPECT_EQ(command.wait(), 0) << command.error_output();
  };
  drain(echo_uuid);
  sut->await_error("is drained and has stopped serving " + std::string(echo_uuid));
  EXPECT_TRUE(sut->running());
  drain(exit_uuid);
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST_F(BatchFolder, RunsTheCurrentVersionOfAScript) {
  install("exit_with.sh");
  install("say_request.sh");
  configure(script(echo_uuid, "say_request.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  configure(script(echo_uuid, "exit_with.sh", "name: 'say_request.sh'"));
  sut->await_error("runs .*exit_with.sh with the new configuration from now on");
  EXPECT_EQ(caller.call(echo_uuid, "4 x").state, 104U);
}

TEST_F(BatchFolder, StaysAsItIsWhenTheConfigurationIsBroken) {
  install("say_request.sh");
  configure(script(echo_uuid, "say_request.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  configure("script { uuid: }");
  sut->await_error("batch.textproto:2:16: ");
  EXPECT_EQ(caller.call(echo_uuid, "still").state, 1U);
}

TEST_F(BatchFolder, EndsAProgramWhoseCallIsWithdrawn) {
  install("outlive.sh");
  configure(script(echo_uuid, "outlive.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  const fs::path pids = folder.path() / "pids";
  const fabric::Request request = caller.request(echo_uuid, pids.string());
  caller.publish(request);
  pid_t leader = 0;
  await("the program's process id",
        [&] { return static_cast<bool>(std::ifstream(pids) >> leader); });
  caller.withdraw(request);
  await("the end of the program", [&] { return !fs::exists("/proc/" + std::to_string(leader)); });
}

TEST_F(BatchFolder, LeavesAProgramThatIsToOutliveItsCall) {
  const fs::path leaves = programs / "leaves.sh";
  std::ofstream(leaves)
      << "#!/bin/sh\n"
      << binary("millrace-batch")
      << " outlive sh -c 'echo $$ >\"$1.part\"; mv \"$1.part\" \"$1\"; exec sleep "
         "600' sh \"$1\"\n";
  fs::permissions(leaves, fs::perms::owner_all);
  configure(script(echo_uuid, "leaves.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  const fs::path file = folder.path() / "pid";
  EXPECT_EQ(caller.call(echo_uuid, file.string()).state, 1U);
  pid_t stays = 0;
  await("the program's process id",
        [&] { return static_cast<bool>(std::ifstream(file) >> stays); });
  EXPECT_TRUE(fs::exists("/proc/" + std::to_string(stays)));
  ::kill(stays, SIGKILL);
}

TEST_F(BatchFolder, FinishesARunningCallBeforeItLeaves) {
  install("wait_for_file.sh");
  configure(script(echo_uuid, "wait_for_file.sh"));
  start();
  ASSERT_TRUE(caller.await_instance(echo_uuid));
  const fs::path started = folder.path() / "go";
  const fabric::Request request = caller.request(echo_uuid, started.string());
  caller.publish(request);
  await("the program's start", [&] { return fs::exists(started.string() + ".waiting"); });
  sut->terminate();
  ASSERT_TRUE(caller.await_no_instance(echo_uuid));
  std::ofstream(started) << "now";
  EXPECT_EQ(caller.await_reply(request).text, "done");
  EXPECT_EQ(sut->wait(), 0) << sut->error_output();
}

TEST(BatchProgram, ServesOneProgramFromTheCommandLine) {
  const Domain domain;
  Caller caller(domain.number());
  Process sut({binary("millrace-batch"), "--exec", program("exit_with.sh").string(), "--uuid",
               exit_uuid, "--domain", std::to_string(domain.number())});
  ASSERT_TRUE(caller.await_instance(exit_uuid));
  EXPECT_EQ(caller.call(exit_uuid, "9 one").state, 109U);
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
}

TEST(BatchProgram, RequiresTheUuidOfTheOneProgram) {
  for (const std::vector<std::string>& given : {std::vector<std::string>{}, {"--uuid", ""}}) {
    std::vector<std::string> command{binary("millrace-batch"), "--exec",
                                     program("exit_with.sh").string()};
    command.insert(command.end(), given.begin(), given.end());
    Process sut(command);
    EXPECT_EQ(sut.wait(), 2);
    EXPECT_THAT(sut.error_output(), HasSubstr("--uuid is required: the service has no UUID"));
    EXPECT_THAT(sut.error_output(), HasSubstr("Start it with --uuid UUID"));
  }
}

TEST(BatchProgram, ShowsHelpForBothModes) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"--exec", "--help"}}) {
    std::vector<std::string> command{binary("millrace-batch")};
    command.insert(command.end(), arguments.begin(), arguments.end());
    Process sut(command);
    EXPECT_EQ(sut.wait(), 0) << sut.error_output();
    EXPECT_THAT(sut.output(),
                HasSubstr(arguments.front() == "--exec" ? "--time-limit" : "--config"));
  }
}

TEST(BatchProgram, UsesTheNameOfItsCommandLine) {
  const Domain domain;
  const TemporaryFolder folder;
  const fs::path config = folder.path() / "batch.textproto";
  std::ofstream(config) << "# nothing yet\n";
  Process sut({binary("millrace-batch"), "--name", "press-scripts", "--config", config.string(),
               "--domain", std::to_string(domain.number())});
  sut.await("^ready: press-scripts serves 0 UUIDs");
}

TEST(BatchProgram, RefusesToStartWithoutItsProgramOrConfiguration) {
  Process no_program({binary("millrace-batch"), "--exec", "/no/such/program", "--uuid", exit_uuid});
  EXPECT_EQ(no_program.wait(), 2);
  EXPECT_THAT(no_program.error_output(), HasSubstr("/no/such/program is missing"));
  Process no_config({binary("millrace-batch"), "--config", "/no/such/file"});
  EXPECT_EQ(no_config.wait(), 2);
  EXPECT_THAT(no_config.error_output(),
              StartsWith("millrace-batch: /no/such/file: cannot be read"));
}

}  // namespace
}  // namespace millrace::tests
