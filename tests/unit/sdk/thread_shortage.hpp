// A process that gets no more threads from its system, for the tests of what is built half way.
//
//   const ThreadShortage shortage(2);       // the third one from now on cannot be started
#pragma once

namespace millrace::tests {

/// While it lives, no thread can be started after `left` more. For the whole process.
class ThreadShortage {
 public:
  explicit ThreadShortage(int left);
  ~ThreadShortage();
  ThreadShortage(const ThreadShortage&) = delete;
  ThreadShortage& operator=(const ThreadShortage&) = delete;
};

}  // namespace millrace::tests
