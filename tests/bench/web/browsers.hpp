// Browsers of `millrace web`, each of which reads all events.
//
//   BrowserProcess browsers(50, 10);
//   browsers.start(port);
//   browsers.finish();
#pragma once

#include <array>
#include <cstdint>

#include <sys/types.h>

#include "tools/recording/statistics.hpp"

namespace millrace::bench {

/// Prints `what`, the number of measured `things`, and their times.
void print_times(const char* what, const char* things, const tools::recording::Histogram& times);

/// In reality browsers are on other hosts: here they are a separate process with low priority.
class BrowserProcess {
 public:
  /// `with_data` of `count` have the view of machine data open. Construct it before there are
  /// threads.
  BrowserProcess(int count, int with_data);
  ~BrowserProcess();
  BrowserProcess(const BrowserProcess&) = delete;
  BrowserProcess& operator=(const BrowserProcess&) = delete;

  /// They read from the server on this port of the loopback.
  void start(std::uint16_t port) const;
  /// The bytes that all of them have read.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Prints their measurements. The server has ended.
  void finish();

 private:
  void serve(int count, int with_data);

  std::array<int, 2> to_{};
  std::array<int, 2> from_{};
  pid_t pid_ = -1;
};

}  // namespace millrace::bench
