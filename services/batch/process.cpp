#include "services/batch/process.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "base/text/ascii.hpp"

namespace millrace::services::batch {

namespace {

using Clock = std::chrono::steady_clock;
using base::posix::Fd;
using base::posix::last_error;

constexpr std::size_t max_input = 4096;

struct Pipe {
  Fd read;
  Fd write;
};

std::optional<Pipe> make_pipe() {
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return std::nullopt;
  }
  return Pipe{.read = Fd(ends[0]), .write = Fd(ends[1])};
}

/// RAII for the arguments of posix_spawn. All calls only fill memory.
class Instructions {
 public:
  Instructions() {
    posix_spawn_file_actions_init(&actions_);
    posix_spawnattr_init(&attributes_);
    // The service blocks and handles signals itself; the process starts with the defaults.
    sigset_t none;
    sigemptyset(&none);
    sigset_t all;
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    posix_spawnattr_setflags(&attributes_,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
  }
  ~Instructions() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  Instructions(const Instructions&) = delete;
  Instructions& operator=(const Instructions&) = delete;

  void stream(const Fd& from, int to) {
    posix_spawn_file_actions_adddup2(&actions_, from.get(), to);
  }
  void open_nothing(int stream) {
    posix_spawn_file_actions_addopen(&actions_, stream, "/dev/null", O_RDWR, 0);
  }
  void close_all_but_streams() { posix_spawn_file_actions_addclosefrom_np(&actions_, 3); }
  void folder(const std::filesystem::path& folder) {
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
  }
  [[nodiscard]] const posix_spawn_file_actions_t* actions() const { return &actions_; }
  [[nodiscard]] const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

/// glibc 2.36 declares pidfd_open without C linkage, so that it does not link from C++.
Fd watch(pid_t pid) {
  return Fd(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
}

std::string_view name_of(std::string_view assignment) {
  return assignment.substr(0, assignment.find('='));
}

/// Variables that processes need to find programs, folders and the language of their user. All
/// others of this service, which may be secrets, are not passed on
/// (docs/reference/services/batch.md).
bool is_passed_on(std::string_view name) {
  constexpr std::array<std::string_view, 8> names{"PATH",  "HOME", "USER", "LOGNAME",
                                                  "SHELL", "LANG", "TZ",   "TMPDIR"};
  return name.starts_with("LC_") || std::ranges::find(names, name) != names.end();
}

/// The variables that are passed on from this process's environment, and `added`.
std::vector<std::string> environment(const std::vector<std::string>& added) {
  std::vector<std::string> all = added;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    if (is_passed_on(name_of(*entry))) {
      all.emplace_back(*entry);
    }
  }
  return all;
}

/// The form that exec expects: pointers with a null at the end. `texts` must outlive it.
std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  all.reserve(texts.size() + 1);
  for (std::string& text : texts) {
    all.push_back(text.data());
  }
  all.push_back(nullptr);
  return all;
}

/// Begins with the reason, since a response has little room.
std::string why(int error, const Command& command) {
  const std::string program = command.program.string();
  switch (error) {
    case ENOEXEC:
      return "no executable and no #! line: " + program;
    case ENOENT:
      return "file, its #! interpreter or working folder missing: " + program;
    default:
      return std::generic_category().message(error) + ": " + program;
  }
}

bool give_input(const Pipe& pipe, const std::string& input) {
  // An empty pipe takes the whole input, so this cannot block; its reader has not started, so it
  // cannot break.
  assert(input.size() <= max_input);
  return ::write(pipe.write.get(), input.data(), input.size()) ==
         static_cast<ssize_t>(input.size());
}

/// Marks the processes of one run. A program that leaves by itself (setsid(2) after fork(2)) does
/// so at any time, also after the end of its call; its environment it has from the beginning.
constexpr std::string_view mark_name = "MILLRACE_BATCH_RUN";

std::string next_mark() {
  static std::atomic<std::uint64_t> number = 0;
  static const auto start = Clock::now().time_since_epoch().count();
  return fmt::format("{}={}-{}-{}", mark_name, ::getpid(), start, ++number);
}

/// A started process, leader of its own session. The caller must reap it.
struct Child {
  pid_t pid = -1;
  std::string mark;
  /// Becomes readable when the process has ended (pidfd).
  base::posix::Fd ended;
  /// The read ends of its standard output and error; non-blocking.
  base::posix::Fd output;
  base::posix::Fd errors;
};

/// Starts `command`; its input is already written and closed when this returns. The error contains
/// the failed step and the reason.
tl::expected<Child, std::string> spawn(const Command& command) {
  const auto input = make_pipe();
  auto output = make_pipe();
  auto errors = make_pipe();
  if (!input || !output || !errors || !give_input(*input, command.input)) {
    return tl::unexpected(last_error("no pipe for " + command.program.string()));
  }
  Instructions instructions;
  instructions.folder(command.folder);
  instructions.stream(input->read, STDIN_FILENO);
  instructions.stream(output->write, STDOUT_FILENO);
  instructions.stream(errors->write, STDERR_FILENO);
  instructions.close_all_but_streams();

  std::vector<std::string> arguments{command.program.string()};
  arguments.insert(arguments.end(), command.arguments.begin(), command.arguments.end());
  std::vector<std::string> variables = environment(command.environment);
  Child child;
  child.mark = next_mark();
  variables.push_back(child.mark);
  const int error = ::posix_spawn(&child.pid, command.program.c_str(), instructions.actions(),
                                  instructions.attributes(), pointers(arguments).data(),
                                  pointers(variables).data());
  if (error != 0) {
    return tl::unexpected(why(error, command));
  }
  child.ended = watch(child.pid);
  if (!child.ended) {
    const std::string reason = last_error("cannot watch " + command.program.string());
    ::kill(-child.pid, SIGKILL);
    ::waitpid(child.pid, nullptr, 0);
    return tl::unexpected(reason);
  }
  child.output = std::move(output->read);
  child.errors = std::move(errors->read);
  ::fcntl(child.output.get(), F_SETFL, O_NONBLOCK);
  ::fcntl(child.errors.get(), F_SETFL, O_NONBLOCK);
  return child;
}

// The processes of a run, in any process group and session.

namespace fs = std::filesystem;

/// The session of a running process, by proc(5): "PID (NAME) STATE PPID PGRP SESSION ...", where
/// the name may contain any characters.
std::optional<pid_t> session_of(const fs::path& process) {
  std::string line;
  if (!std::getline(std::ifstream(process / "stat"), line)) {
    return std::nullopt;
  }
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) {
    return std::nullopt;
  }
  std::istringstream rest(line.substr(name_end + 1));
  char state = 0;
  pid_t parent = 0;
  pid_t group = 0;
  pid_t session = 0;
  const bool runs = (rest >> state >> parent >> group >> session) && state != 'Z' && state != 'X';
  return runs ? std::optional(session) : std::nullopt;
}

/// Whether the environment of a process has `assignment`; false if it is another user's.
bool has_variable(const fs::path& process, const std::string& assignment) {
  std::ifstream environment(process / "environ", std::ios::binary);
  for (std::string each; std::getline(environment, each, '\0');) {
    if (each == assignment) {
      return true;
    }
  }
  return false;
}

/// The running processes of a run, without zombies: those in its session, which keeps its number
/// until its leader is reaped, and those with its mark.
std::vector<pid_t> processes_of(const Child& child) {
  std::vector<pid_t> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator("/proc", failed)) {
    const auto pid = base::text::parse_number<pid_t>(entry.path().filename().string());
    const auto session = pid ? session_of(entry.path()) : std::nullopt;
    if (session && (session == child.pid || has_variable(entry.path(), child.mark))) {
      found.push_back(*pid);
    }
  }
  return found;
}

/// Sends `signal` to all of them.
void signal_all(const Child& child, int signal) {
  for (const pid_t process : processes_of(child)) {
    ::kill(process, signal);
  }
}

/// Ends all of them (SIGKILL), also those that start during this call.
void kill_all(const Child& child) {
  // A killed process starts no further one: when no new process is found, all are killed.
  std::set<pid_t> killed;
  for (bool more = true; more;) {
    more = false;
    for (const pid_t process : processes_of(child)) {
      ::kill(process, SIGKILL);
      more = killed.insert(process).second || more;
    }
  }
}

/// The longest delay until a cancelled call is noticed.
constexpr std::chrono::milliseconds look_up{50};

/// The most bytes in a pipe, so the most that is left when the process has ended.
constexpr std::size_t pipe_capacity = 1 << 20;

/// Reads the available bytes, at most one full pipe; closes `fd` at its end.
void drain(Fd& fd, Captured& into, std::size_t keep) {
  std::array<char, 4096> bytes{};
  for (std::size_t total = 0; fd && total < pipe_capacity;) {
    const ssize_t count = ::read(fd.get(), bytes.data(), bytes.size());
    if (count < 0) {
      return;  // no bytes available now
    }
    if (count == 0) {
      fd.close();
      return;
    }
    const auto size = static_cast<std::size_t>(count);
    into.text.append(bytes.data(), std::min(size, keep - into.text.size()));
    into.size += size;
    total += size;
  }
}

/// One running process, and the decision when to end it.
class Run {
 public:
  Run(Child child, const Limits& limits, const Unwanted& unwanted)
      : child_(std::move(child)),
        limits_(limits),
        unwanted_(unwanted),
        next_(Clock::now() + limits.time_limit) {}

  Ended finish() {
    while (!wait()) {
    }
    // The zombie keeps its number, so the session is still ours to end.
    kill_all(child_);
    drain(child_.output, ended_.output, limits_.max_output);
    drain(child_.errors, ended_.errors, limits_.max_errors);
    reap();
    return std::move(ended_);
  }

 private:
  enum class Phase : std::uint8_t { running, asked_to_end, killed };

  /// Waits for the next event and handles it; true once the process has ended.
  bool wait() {
    std::array<pollfd, 3> events{pollfd{child_.ended.get(), POLLIN, 0},
                                 pollfd{child_.output.get(), POLLIN, 0},
                                 pollfd{child_.errors.get(), POLLIN, 0}};
    ::poll(events.data(), events.size(), remaining());
    drain(child_.output, ended_.output, limits_.max_output);
    drain(child_.errors, ended_.errors, limits_.max_errors);
    if (events[0].revents != 0) {
      return true;
    }
    if (phase_ == Phase::running && unwanted_()) {
      end_early(End::unwanted);
    } else if (phase_ != Phase::killed && Clock::now() >= next_) {
      end_early(End::time_limit);
    }
    return false;
  }

  /// Milliseconds until the next step of ending it; -1 if only its end is left to wait for.
  [[nodiscard]] int remaining() const {
    if (phase_ == Phase::killed) {
      return -1;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next_ - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, look_up.count()));
  }

  void end_early(End end) {
    if (phase_ == Phase::running) {
      early_ = end;
      phase_ = Phase::asked_to_end;
      next_ = Clock::now() + limits_.kill_after;
      signal_all(child_, SIGTERM);
      // A stopped (SIGSTOP) process could not handle it.
      signal_all(child_, SIGCONT);
    } else {
      phase_ = Phase::killed;
      kill_all(child_);
    }
  }

  void reap() {
    int status = 0;
    ::waitpid(child_.pid, &status, 0);
    if (early_) {
      ended_.end = *early_;
    } else if (WIFSIGNALED(status)) {
      ended_.end = End::signalled;
      ended_.code = WTERMSIG(status);
    } else {
      ended_.end = End::exited;
      ended_.code = WEXITSTATUS(status);
    }
  }

  Child child_;
  Limits limits_;
  const Unwanted& unwanted_;
  Phase phase_ = Phase::running;
  Clock::time_point next_;
  std::optional<End> early_;
  Ended ended_;
};

/// The call's pipes: the service reads them until the call ends only.
bool is_pipe(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) != 0 || S_ISFIFO(status.st_mode);
}

}  // namespace

tl::expected<pid_t, std::string> outlive(std::vector<std::string> arguments) {
  Instructions instructions;
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (is_pipe(stream)) {
      instructions.open_nothing(stream);
    }
  }
  std::vector<std::string> variables;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    if (name_of(*entry) != mark_name) {
      variables.emplace_back(*entry);
    }
  }
  pid_t pid = -1;
  // Returns when the program runs: in its session, with its environment.
  const int error = ::posix_spawnp(&pid, arguments.front().c_str(), instructions.actions(),
                                   instructions.attributes(), pointers(arguments).data(),
                                   pointers(variables).data());
  if (error != 0) {
    return tl::unexpected(std::generic_category().message(error) + ": " + arguments.front());
  }
  return pid;
}

Ended run(const Command& command, const Limits& limits, const Unwanted& unwanted) {
  if (unwanted()) {
    return {.end = End::unwanted};
  }
  auto child = spawn(command);
  if (!child) {
    return {.end = End::not_started, .reason = child.error()};
  }
  return Run(std::move(*child), limits, unwanted).finish();
}

}  // namespace millrace::services::batch
