// A process's resources, from the kernel.
#pragma once

#include <ctime>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

namespace millrace::bench {

/// A sanitizer keeps freed memory for a while, to detect use after free; the size of a process then
/// says little.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool keeps_what_is_freed = true;
#else
inline constexpr bool keeps_what_is_freed = false;
#endif

inline double resident_mib(pid_t process) {
  std::ifstream statm(fmt::format("/proc/{}/statm", process));
  long total = 0;
  long resident = 0;
  statm >> total >> resident;
  return static_cast<double>(resident * ::sysconf(_SC_PAGESIZE)) / (1024 * 1024);
}

/// Seconds of processor time since its start, to the microsecond (/proc counts in hundredths of a
/// second); 0 without such a process.
inline double processor_seconds(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &time) != 0) {
    return 0;
  }
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
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
