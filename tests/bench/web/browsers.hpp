// Browsers of `millrace web`, as many as are asked for, each of which reads all that it is told.
//
//   BrowserProcess browsers(50, 10);
//   browsers.start(port);
//   browsers.finish();
#pragma once

#include <array>
#include <cstdint>

#include <sys/types.h>

#include "tools/recording/histogram.hpp"

namespace millrace::bench {

/// `what`, how many of `things` were timed, and how long they took.
void print_times(const char* what, const char* things, const tools::recording::Histogram& times);

/// Browsers are on other hosts: here they are a process of their own, which gives way.
class BrowserProcess {
 public:
  /// `with_data` of `count` have the view of machine data open. To be made before there are
  /// threads.
  BrowserProcess(int count, int with_data);
  ~BrowserProcess();
  BrowserProcess(const BrowserProcess&) = delete;
  BrowserProcess& operator=(const BrowserProcess&) = delete;

  /// They read what the server on this port of the loopback tells.
  void start(std::uint16_t port) const;
  /// Bytes that all of them have read.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Prints what they measured. The server has ended.
  void finish();

 private:
  void serve(int count, int with_data);

  std::array<int, 2> to_{};
  std::array<int, 2> from_{};
  pid_t pid_ = -1;
};

}  // namespace millrace::bench
