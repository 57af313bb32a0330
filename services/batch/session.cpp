#include "services/batch/session.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "base/text/number.hpp"

namespace millrace::services::batch {

namespace {

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

}  // namespace

std::vector<pid_t> processes_of(pid_t session) {
  std::vector<pid_t> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator("/proc", failed)) {
    const auto pid = base::text::parse_number<pid_t>(entry.path().filename().string());
    if (pid && session_of(entry.path()) == session) {
      found.push_back(*pid);
    }
  }
  return found;
}

void signal_session(pid_t session, int signal) {
  for (const pid_t process : processes_of(session)) {
    ::kill(process, signal);
  }
}

void kill_session(pid_t session) {
  // A killed process starts no further one: when no new process is found, all are killed.
  std::set<pid_t> killed;
  for (bool more = true; more;) {
    more = false;
    for (const pid_t process : processes_of(session)) {
      ::kill(process, SIGKILL);
      more = killed.insert(process).second || more;
    }
  }
}

}  // namespace millrace::services::batch
