// A process that cannot start further threads, for tests of partly constructed objects.
//
//   const ThreadShortage shortage(2);       // the third one from now on cannot be started
#pragma once

namespace millrace::tests {

/// While it exists, only `left` more threads can be started, in the whole process.
class ThreadShortage {
 public:
  explicit ThreadShortage(int left);
  ~ThreadShortage();
  ThreadShortage(const ThreadShortage&) = delete;
  ThreadShortage& operator=(const ThreadShortage&) = delete;
};

}  // namespace millrace::tests
