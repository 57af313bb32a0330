// What a process uses, as /proc tells it.
#pragma once

#include <fstream>
#include <string>

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

namespace millrace::bench {

inline double resident_mib(pid_t process) {
  std::ifstream statm(fmt::format("/proc/{}/statm", process));
  long total = 0;
  long resident = 0;
  statm >> total >> resident;
  return static_cast<double>(resident * ::sysconf(_SC_PAGESIZE)) / (1024 * 1024);
}

/// Seconds of processor time since its start.
inline double processor_seconds(pid_t process) {
  std::ifstream stat(fmt::format("/proc/{}/stat", process));
  std::string field;
  // The 14th and 15th field, proc(5); the name, which is the second, has no blank.
  for (int i = 1; i < 14; ++i) {
    stat >> field;
  }
  long user = 0;
  long system = 0;
  stat >> user >> system;
  return static_cast<double>(user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

/// The same of this process, in microseconds.
inline double own_processor_microseconds() {
  rusage use{};
  ::getrusage(RUSAGE_SELF, &use);
  const auto of = [](const timeval& time) {
    return 1e6 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec);
  };
  return of(use.ru_utime) + of(use.ru_stime);
}

}  // namespace millrace::bench
