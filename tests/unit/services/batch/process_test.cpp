#include "services/batch/process.hpp"

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "tests/support/await.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::batch {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// A shell with this script, which has the arguments as $1, $2 ….
Command shell(const std::string& script, const std::vector<std::string>& arguments = {},
              std::string input = {}) {
  Command command{.program = "/bin/sh",
                  .arguments = {"-c", script, "sh"},
                  .folder = "/",
                  .input = std::move(input)};
  command.arguments.insert(command.arguments.end(), arguments.begin(), arguments.end());
  return command;
}

const Limits generous{.time_limit = 30s, .kill_after = 30s};

/// As in /proc; 'X' if there is no such process.
char state_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  return std::getline(file, text) ? text.at(text.rfind(") ") + 2) : 'X';
}

/// True for a process that has ended, or is a zombie of its new parent.
bool is_over(pid_t pid) {
  const char state = state_of(pid);
  return state == 'X' || state == 'Z';
}

/// Killed processes end after some time.
void wait_until_over(pid_t pid) {
  tests::await("the end of process " + std::to_string(pid), [&] { return is_over(pid); });
}

TEST(Process, PassesTheRequestAsOneArgumentAndOnStandardInput) {
  const std::string request = "$(touch x); `id` | rm -rf '*' \\ \"a b\"";
  const Ended sut =
      run(shell("read -r line; printf '[%s] [%s]\\n' \"$1\" \"$line\"", {request}, request + "\n"),
          generous);
  EXPECT_EQ(sut.end, End::exited);
  EXPECT_EQ(sut.output.text, "[" + request + "] [" + request + "]\n");
}

TEST(Process, KeepsAnEmptyArgument) {
  EXPECT_EQ(run(shell("echo $#", {"", "a b"}), generous).output.text, "2\n");
}

TEST(Process, ReturnsTheExitCode) {
  const Ended sut = run(shell("printf text; exit 7"), generous);
  EXPECT_EQ(sut.end, End::exited);
  EXPECT_EQ(sut.code, 7);
  EXPECT_EQ(sut.output.text, "text");
}

TEST(Process, ReturnsTheSignal) {
  const Ended sut = run(shell("kill -s SEGV $$"), generous);
  EXPECT_EQ(sut.end, End::signalled);
  EXPECT_EQ(sut.code, SIGSEGV);
}

TEST(Process, InheritsNoDescriptorButItsStreams) {
  const base::posix::Fd open_here(::fcntl(STDERR_FILENO, F_DUPFD, 77));  // not close-on-exec
  ASSERT_GE(open_here.get(), 77);
  // Without the one that ls opens for the folder.
  const Ended sut = run(shell("ls /proc/$$/fd | tr '\\n' ' '"), generous);
  EXPECT_THAT(sut.output.text, StartsWith("0 1 "));
  EXPECT_THAT(" " + sut.output.text, Not(HasSubstr(" " + std::to_string(open_here.get()) + " ")));
}

TEST(Process, StartsWithSignalsAsTheyAreByDefault) {
  sigset_t blocked;
  sigset_t before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
  const Ended sut = run(shell("kill -s TERM $$"), generous);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(sut.end, End::signalled);
}

TEST(Process, KeepsTheFirstBytesAndCountsAll) {
  const Command command = shell("head -c 300000 /dev/zero | tr '\\0' x; echo y >&2");
  Limits limits = generous;
  limits.max_output = 128;
  const Ended sut = run(command, limits);
  EXPECT_EQ(sut.output.text, std::string(128, 'x'));
  EXPECT_EQ(sut.output.size, 300000U);
  EXPECT_EQ(sut.errors.text, "y\n");
}

TEST(Process, RunsInItsFolder) {
  Command command = shell("pwd");
  command.folder = "/usr";
  EXPECT_EQ(run(command, generous).output.text, "/usr\n");
}

TEST(Process, DoesNotWaitForWhatAProgramLeavesBehind) {
  const Ended sut = run(shell("sleep 600 & echo $!"), generous);
  EXPECT_EQ(sut.end, End::exited);
  wait_until_over(std::stoi(sut.output.text));
}

TEST(Process, HasNothingOfTheServicesEnvironmentButWhatIsListed) {
  ::setenv("MILLRACE_TEST_SECRET", "hunter2", 1);
  ::setenv("LC_TIME", "C", 1);
  Command command = shell("env");
  command.environment = {"MILLRACE_CALL=5f-1"};
  const Ended sut = run(command, generous);
  ::unsetenv("MILLRACE_TEST_SECRET");
  EXPECT_THAT(sut.output.text, Not(HasSubstr("hunter2")));
  EXPECT_THAT(sut.output.text, HasSubstr("MILLRACE_CALL=5f-1\n"));
  EXPECT_THAT(sut.output.text, HasSubstr("LC_TIME=C\n"));
  EXPECT_THAT(sut.output.text, HasSubstr("PATH="));
}

const std::string writes_pids = "echo \"$$ $!\" >\"$1.part\"; mv \"$1.part\" \"$1\"; ";
const std::string ignores_sigterm = "trap '' TERM; while :; do sleep 1; done";
/// Starts a helper that ignores SIGTERM, and stays.
const std::string outlives = "sh -c \"" + ignores_sigterm + "\" & " + writes_pids + ignores_sigterm;
/// The same, with the helper in a process group of its own, as a shell with job control makes one.
const std::string changes_group =
    "set -m; sh -c \"" + ignores_sigterm + "\" & set +m; " + writes_pids + ignores_sigterm;

class OutlivingProcess : public testing::Test {
 protected:
  OutlivingProcess() : file_(folder_.path() / "pids") {}

  /// It writes the process ids of its shell and its helper to the file named by its argument.
  Command command(const std::string& script = outlives) { return shell(script, {file_}); }
  /// Runs it with a time limit in which it can write its process ids: on a busy host the first may
  /// be too short.
  Ended run_into_limit(const Command& command) {
    Ended ended;
    for (std::chrono::milliseconds limit{300}; limit < 1min; limit *= 4) {
      ended = run(command, {.time_limit = limit, .kill_after = 50ms});
      if (std::filesystem::exists(file_)) {
        break;
      }
    }
    return ended;
  }
  [[nodiscard]] const std::string& file() const { return file_; }
  /// Waits until the process and its helper have written their process ids.
  std::pair<pid_t, pid_t> pids() {
    std::pair<pid_t, pid_t> pids{0, 0};
    tests::await("the process ids", [&] {
      return static_cast<bool>(std::ifstream(file_) >> pids.first >> pids.second);
    });
    return pids;
  }

 private:
  tests::TemporaryFolder folder_;
  std::string file_;
};

TEST_F(OutlivingProcess, IsEndedWithItsGroupWhenTheTimeIsOver) {
  const Ended sut = run_into_limit(command());
  EXPECT_EQ(sut.end, End::time_limit);
  const auto [leader, helper] = pids();
  EXPECT_TRUE(is_over(leader));
  wait_until_over(helper);
}

TEST_F(OutlivingProcess, IsEndedInAnotherProcessGroupWhenTheTimeIsOver) {
  const Ended sut = run_into_limit(command(changes_group));
  EXPECT_EQ(sut.end, End::time_limit);
  wait_until_over(pids().second);
}

TEST_F(OutlivingProcess, IsEndedInAnotherProcessGroupThatIsLeftBehind) {
  const Ended sut = run(command("set -m; sleep 600 >/dev/null 2>&1 & " + writes_pids), generous);
  EXPECT_EQ(sut.end, End::exited);
  wait_until_over(pids().second);
}

TEST_F(OutlivingProcess, IsEndedWhetherOrNotItHasASessionOfItsOwnYet) {
  const std::string in_a_session =
      "setsid sh -c 'echo \"0 $$\" >\"$1.part\"; mv \"$1.part\" \"$1\"; exec sleep 600' sh \"$1\" "
      ">/dev/null 2>&1 & ";
  const std::string later = "while [ ! -e \"$1\" ]; do sleep 0.01; done";
  EXPECT_EQ(run(command(in_a_session + later), generous).end, End::exited);
  wait_until_over(pids().second);
  // In the second, the shell ends while its child may be anywhere before setsid(2).
  std::filesystem::remove(file());
  EXPECT_EQ(run(command(in_a_session + "true"), generous).end, End::exited);
  if (std::filesystem::exists(file())) {
    wait_until_over(pids().second);
  }
}

/// QEMU does not say why a program does not start: its vfork(2) is a fork(2).
bool spawn_reports_errors() {
  pid_t pid = 0;
  char name[] = "/no/such/program";
  char* arguments[] = {name, nullptr};
  const int error = ::posix_spawn(&pid, name, nullptr, nullptr, arguments, environ);
  if (error == 0) {
    ::waitpid(pid, nullptr, 0);
  }
  return error != 0;
}

TEST(Outlive, StartsAProgramInASessionOfItsOwnWithoutTheMarkOfItsRun) {
  if (!spawn_reports_errors()) {
    GTEST_SKIP() << "this processor is emulated";
  }
  ::setenv("MILLRACE_BATCH_RUN", "1-2-3", 1);
  const auto sut = outlive({"sleep", "600"});
  ::unsetenv("MILLRACE_BATCH_RUN");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(::getsid(*sut), *sut);
  // Empty while the kernel starts the program.
  std::string all;
  tests::await("the environment of process " + std::to_string(*sut), [&] {
    std::ifstream environment("/proc/" + std::to_string(*sut) + "/environ");
    all.assign(std::istreambuf_iterator<char>(environment), {});
    return !all.empty();
  });
  EXPECT_THAT(all, HasSubstr("PATH="));
  EXPECT_THAT(all, Not(HasSubstr("MILLRACE_BATCH_RUN")));
  ::kill(*sut, SIGKILL);
  ::waitpid(*sut, nullptr, 0);
  EXPECT_THAT(outlive({"/no/such/program"}).error(), HasSubstr("/no/such/program"));
}

TEST_F(OutlivingProcess, IsEndedWithItsGroupWhenItIsCancelled) {
  std::atomic<bool> unwanted = false;
  Ended sut;
  std::thread runner([&] {
    sut = run(command(), {.time_limit = 60s, .kill_after = 50ms}, [&] { return unwanted.load(); });
  });
  const auto [leader, helper] = pids();
  unwanted = true;
  runner.join();
  EXPECT_EQ(sut.end, End::unwanted);
  EXPECT_TRUE(is_over(leader));
  wait_until_over(helper);
}

TEST(Process, CanEndItselfInOrderAlsoWhenItIsStopped) {
  const tests::TemporaryFolder folder;
  const std::string file = folder.path() / "pid";
  const auto is_stopped = [&] {
    pid_t pid = 0;
    return static_cast<bool>(std::ifstream(file) >> pid) && state_of(pid) == 'T';
  };
  const Ended sut = run(shell("trap 'echo in order; exit' TERM; echo $$ >\"$1.part\"; "
                              "mv \"$1.part\" \"$1\"; kill -s STOP $$; exec sleep 600",
                              {file}),
                        generous, is_stopped);
  EXPECT_EQ(sut.end, End::unwanted);
  EXPECT_EQ(sut.output.text, "in order\n");
}

TEST(Process, IsNotStartedForAWithdrawnCall) {
  EXPECT_EQ(run(shell("sleep 600"), generous, [] { return true; }).end, End::unwanted);
}

struct NotStartable {
  /// Empty: there is no such file.
  std::string content;
  std::filesystem::perms permissions;
  std::string reason;
};

class NotStarted : public testing::TestWithParam<NotStartable> {};

TEST_P(NotStarted, NamesTheReason) {
  if (!spawn_reports_errors()) {
    GTEST_SKIP() << "this processor is emulated";
  }
  const tests::TemporaryFolder folder;
  const std::filesystem::path program = folder.path() / "program";
  if (!GetParam().content.empty()) {
    std::ofstream(program) << GetParam().content;
    std::filesystem::permissions(program, GetParam().permissions);
  }
  const Ended sut = run({.program = program, .folder = folder.path()}, generous);
  EXPECT_EQ(sut.end, End::not_started);
  EXPECT_THAT(sut.reason, HasSubstr(GetParam().reason));
  EXPECT_THAT(sut.reason, HasSubstr(program.string()));
}

INSTANTIATE_TEST_SUITE_P(Programs, NotStarted,
                         testing::Values(NotStartable{"", {}, "missing"},
                                         NotStartable{"#!/no/such/interpreter\n",
                                                      std::filesystem::perms(0755), "interpreter"},
                                         NotStartable{"echo no first line\n",
                                                      std::filesystem::perms(0755), "#! line"},
                                         NotStartable{"#!/bin/sh\n", std::filesystem::perms(0644),
                                                      "Permission denied"}));

TEST(Process, IsNotStartedFromAFolder) {
  if (!spawn_reports_errors()) {
    GTEST_SKIP() << "this processor is emulated";
  }
  const Ended sut = run({.program = "/usr", .folder = "/"}, generous);
  EXPECT_EQ(sut.end, End::not_started);
  EXPECT_THAT(sut.reason, HasSubstr("Permission denied"));
}

}  // namespace
}  // namespace millrace::services::batch
