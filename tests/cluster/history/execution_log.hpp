// What services did, by their own records: all append to one file, one line per step, so that
// nothing is lost with a killed process.
//
//   started slow-1 5f3a9c01-17 1 cnc/2
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::tests::cluster {

enum class Step { started, finished };

struct Execution {
  Step step = Step::started;
  /// The name of the service that ran the call.
  std::string service;
  std::string call;
  std::uint32_t attempt = 0;
  std::string channel;
};

/// The writing side; its functions may be called from any thread.
class ExecutionLog {
 public:
  /// Throws std::system_error if the file cannot be opened.
  ExecutionLog(const std::filesystem::path& file, std::string service);
  ~ExecutionLog();
  ExecutionLog(const ExecutionLog&) = delete;
  ExecutionLog& operator=(const ExecutionLog&) = delete;

  void started(fabric::CallId call, std::uint32_t attempt, const fabric::ChannelKey& channel);
  void finished(fabric::CallId call, std::uint32_t attempt, const fabric::ChannelKey& channel);

 private:
  void add(const char* step, fabric::CallId call, std::uint32_t attempt,
           const fabric::ChannelKey& channel);

  int file_;
  std::string service_;
};

/// The whole file, in the order in which it was written.
std::vector<Execution> read_executions(const std::filesystem::path& file);

}  // namespace millrace::tests::cluster
