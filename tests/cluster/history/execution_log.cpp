#include "tests/cluster/history/execution_log.hpp"

#include <fstream>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace millrace::tests::cluster {

ExecutionLog::ExecutionLog(const std::filesystem::path& file, std::string service)
    : file_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666)),
      service_(std::move(service)) {
  if (file_ < 0) {
    throw std::system_error(errno, std::generic_category(), file.string());
  }
}

ExecutionLog::~ExecutionLog() {
  ::close(file_);
}

void ExecutionLog::started(fabric::CallId call, std::uint32_t attempt,
                           const fabric::ChannelKey& channel) {
  add("started", call, attempt, channel);
}

void ExecutionLog::finished(fabric::CallId call, std::uint32_t attempt,
                            const fabric::ChannelKey& channel) {
  add("finished", call, attempt, channel);
}

void ExecutionLog::add(const char* step, fabric::CallId call, std::uint32_t attempt,
                       const fabric::ChannelKey& channel) {
  const std::string line = fmt::format("{} {} {} {} {}\n", step, service_, call.to_string(),
                                       attempt, channel.to_string());
  // A single write of a short line to a file opened with O_APPEND is never mixed with another one.
  if (::write(file_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw std::system_error(errno, std::generic_category(), "cannot record an execution");
  }
}

std::vector<Execution> read_executions(const std::filesystem::path& file) {
  std::ifstream lines(file);
  std::vector<Execution> executions;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string step;
    Execution execution;
    words >> step >> execution.service >> execution.call >> execution.attempt >> execution.channel;
    execution.step = step == "started" ? Step::started : Step::finished;
    executions.push_back(std::move(execution));
  }
  return executions;
}

}  // namespace millrace::tests::cluster
