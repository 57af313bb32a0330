#include "tools/web/live/process.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <sys/resource.h>
#include <unistd.h>

namespace millrace::tools::web::live {

namespace {

double seconds_of(const timeval& time) {
  constexpr double per_second = 1e6;
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / per_second;
}

}  // namespace

ProcessUse process_use() {
  ProcessUse use;
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0) {
    use.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  }
  // proc(5): total size in pages, then resident size.
  std::ifstream statm("/proc/self/statm");
  double all = 0;
  double resident = 0;
  if (statm >> all >> resident) {
    use.resident_bytes = resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
  }
  std::error_code error;
  const std::filesystem::directory_iterator files("/proc/self/fd", error);
  if (!error) {
    use.open_files = static_cast<double>(std::distance(begin(files), end(files)));
  }
  return use;
}

}  // namespace millrace::tools::web::live
