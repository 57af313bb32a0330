#include "tests/cluster/plant.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/journal/format.hpp"

namespace millrace::tests::cluster {

namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Of the order in which losses and delays strike; the same in each run.
constexpr std::uint64_t seed = 20260301;

constexpr const char* default_profile = "one_network.fabric.textproto";

constexpr const char* port = "48898";

std::string read_file(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& mark, const std::string& value) {
  for (auto at = text.find(mark); at != std::string::npos; at = text.find(mark, at)) {
    text.replace(at, mark.size(), value);
  }
  return text;
}

std::string net_id(const std::string& address) {
  return address + ".1.1";
}

}  // namespace

Plant::Plant(Backend backend)
    : hosts_(make_hosts(
          backend, {"gateway", "recorder", "controller", "service-1", "service-2", "service-3"},
          seed)) {
  for (const auto& entry : std::filesystem::directory_iterator(MILLRACE_PROFILES)) {
    std::filesystem::copy_file(entry.path(), hosts_->folder() / entry.path().filename());
  }
}

void Plant::set_profile(const std::string& host, const std::string& file) {
  profiles_[host] = file;
}

Flags Plant::joining(const std::string& host) const {
  const auto own = profiles_.find(host);
  const std::string file = own == profiles_.end() ? default_profile : own->second;
  return {"--fabric-config", hosts_->folder() / file};
}

Task& Plant::start(const std::string& host, const std::string& name, const std::string& program,
                   Flags flags) {
  auto& task = tasks_[name];
  task = hosts_->up(host, program, flags);
  task->await("^ready: ");
  return *task;
}

std::string Plant::write_program(const Load& load) const {
  std::string text = read_file(MILLRACE_TEST_DATA "/nc/cluster/counting.nc");
  text = replaced(text, "@UUID@", load.uuid);
  text = replaced(text, "@CALLS@", std::to_string(load.calls));
  const std::filesystem::path file = hosts_->folder() / "counting.nc";
  std::ofstream(file) << text;
  return file;
}

Task& Plant::cnc(const Load& load) {
  load_ = load;
  const std::string address = hosts_->address("controller");
  const std::string program = write_program(load);
  Flags flags{"--listen",      address + ":" + port,          "--net-id",  net_id(address),
              "--channels",    std::to_string(load.channels), "--timings", "--dir",
              hosts_->folder()};
  for (std::uint32_t channel = 1; channel <= load.channels; ++channel) {
    flags.insert(flags.end(), {"--run", fmt::format("{}={}", channel, program)});
  }
  return start("controller", "cnc", "millrace-cnc", std::move(flags));
}

Task& Plant::gateway(const Flags& flags) {
  const std::string address = hosts_->address("controller");
  Flags all = joining("gateway");
  all.insert(all.end(), {"--machine", fmt::format("cnc={}:{}/{}", address, port, net_id(address)),
                         "--journal", hosts_->folder() / "journal"});
  all.insert(all.end(), flags.begin(), flags.end());
  return start("gateway", "gateway", "millrace-gateway", std::move(all));
}

Task& Plant::service(const std::string& host, const std::string& name, const Flags& flags) {
  Flags all = joining(host);
  all.insert(all.end(), {"--name", name, "--record", hosts_->folder() / "executions"});
  all.insert(all.end(), flags.begin(), flags.end());
  return start(host, name, "millrace-slow-service", std::move(all));
}

std::size_t Plant::finished() const {
  const auto executions = read_executions(hosts_->folder() / "executions");
  return static_cast<std::size_t>(std::ranges::count(executions, Step::finished, &Execution::step));
}

std::chrono::duration<double> Plant::await_finished(std::size_t more) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t wanted = finished() + more;
  while (finished() < wanted) {
    if (std::chrono::steady_clock::now() - start > patience) {
      throw std::runtime_error(
          fmt::format("only {} of {} calls were finished in time", finished(), wanted));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return std::chrono::steady_clock::now() - start;
}

History Plant::history() const {
  const std::string bytes = read_file(hosts_->folder() / "journal" / "calls.journal");
  return {gateway::journal::decode(bytes).entries,
          read_executions(hosts_->folder() / "executions")};
}

void Plant::expect_all_answered(std::chrono::milliseconds timeout) {
  Task& cnc = task("cnc");
  for (std::uint32_t channel = 1; channel <= load_.channels; ++channel) {
    cnc.await(fmt::format("^\\[ch{}\\] {} calls answered$", channel, load_.calls), timeout);
  }
  EXPECT_THAT(cnc.output(), Not(HasSubstr("wrong answer")));
  // The CNC goes last: the gateway has yet to hear that its last write was done.
  Task& gateway = task("gateway");
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  cnc.terminate();
  EXPECT_EQ(cnc.wait(), 0);
  EXPECT_THAT(violations(history()), IsEmpty());
}

std::string Plant::logs() const {
  std::string text;
  for (const auto& [name, task] : tasks_) {
    text += fmt::format("--- {}: standard output\n{}--- {}: log\n{}", name, task->output(), name,
                        task->log());
  }
  return text;
}

}  // namespace millrace::tests::cluster
