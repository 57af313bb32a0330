#include "tests/cluster/plant.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/journal/format.hpp"
#include "tests/support/data.hpp"
#include "tools/mcap/file.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tests::cluster {

namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Determines losses and delays; the same in each run.
constexpr std::uint64_t seed = 20260301;

constexpr const char* default_profile = "one_network.fabric.textproto";
/// The setting in shipped profiles, whose credentials must be issued first.
constexpr const char* shipped_trust = "trust { folder: \"$CREDENTIALS_DIRECTORY\" }";

/// The user in docker/Dockerfile.
constexpr uid_t container_user = 10001;

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
          backend,
          {"gateway", "recorder", "controller", "service-1", "service-2", "service-3", "service-4"},
          seed)) {
  for (const auto& entry : std::filesystem::directory_iterator(MILLRACE_PROFILES)) {
    std::ofstream(hosts_->folder() / entry.path().filename())
        << replaced(read_file(entry.path()), shipped_trust, "unprotected: true");
  }
}

void Plant::with_trust() {
  trust_.emplace(hosts_->folder(), std::vector<std::string>{slow_uuid});
  const std::filesystem::path plant = hosts_->folder() / "plant";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(plant)) {
    // Containers run as their own user.
    if (::chown(entry.path().c_str(), container_user, container_user) != 0) {
      throw std::system_error(errno, std::generic_category(), entry.path().string());
    }
  }
  if (::chown(plant.c_str(), container_user, container_user) != 0) {
    throw std::system_error(errno, std::generic_category(), plant.string());
  }
}

void Plant::set_profile(const std::string& host, const std::string& file) {
  profiles_[host] = file;
}

Flags Plant::joining(const std::string& host, const std::string& program) const {
  const auto own = profiles_.find(host);
  const std::string file = own == profiles_.end() ? default_profile : own->second;
  if (trust_) {
    return {"--fabric-config", trust_->profile(TrustCredentials::member_of(program),
                                               replaced(read_file(hosts_->folder() / file),
                                                        "unprotected: true", "# trust below"))};
  }
  return {"--fabric-config", hosts_->folder() / file};
}

Task& Plant::run(const std::string& host, const std::string& name, const std::string& program,
                 const Flags& flags) {
  auto& task = tasks_[name];
  task = hosts_->up(host, program, flags);
  task->await("^ready: ");
  return *task;
}

Task& Plant::start(const std::string& host, const std::string& name, const std::string& program,
                   Flags flags) {
  const Flags join = joining(host, program);
  flags.insert(flags.end(), join.begin(), join.end());
  return run(host, name, program, flags);
}

std::string Plant::millrace(const std::string& host, Flags flags, int exit_code) {
  const Flags join = joining(host, "millrace");
  flags.insert(flags.end(), join.begin(), join.end());
  const auto task = hosts_->up(host, "millrace", flags);
  EXPECT_EQ(task->wait(), exit_code) << task->output() << task->log();
  return task->output();
}

void Plant::record() {
  if (!tasks_.contains("recorder")) {
    start(recorder_host_, "recorder", "millrace", {"record", "-o", recording()});
  }
}

void Plant::record_again() {
  tasks_.erase("recorder");
  record();
}

void Plant::end_recording() {
  Task& recorder = task("recorder");
  recorder.terminate();
  EXPECT_EQ(recorder.wait(), 0) << recorder.log();
  EXPECT_THAT(recorder.log(), HasSubstr("and 0 lost;"));
}

std::string Plant::write_program(const Load& load) const {
  std::string text = read_file(test_data("nc/cluster/" + load.program));
  text = replaced(text, "@UUID@", load.uuid);
  text = replaced(text, "@CALLS@", std::to_string(load.calls));
  const std::filesystem::path file = hosts_->folder() / load.program;
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
  return run("controller", "cnc", "millrace-cnc", flags);
}

Task& Plant::gateway(const Flags& flags) {
  record();
  // A new gateway begins its journal without ended calls.
  for (const gateway::JournalEntry& entry : journal()) {
    if (const auto* over = std::get_if<gateway::EndedEntry>(&entry)) {
      ended_before_.insert(over->call.to_string());
    }
  }
  const std::string address = hosts_->address("controller");
  Flags all = joining("gateway", "millrace-gateway");
  all.insert(all.end(), {"--machine", fmt::format("cnc={}:{}/{}", address, port, net_id(address)),
                         "--journal", hosts_->folder() / "journal"});
  all.insert(all.end(), flags.begin(), flags.end());
  return run("gateway", "gateway", "millrace-gateway", all);
}

Flags Plant::of_service(const std::string& host, const std::string& name,
                        const Flags& flags) const {
  Flags all = joining(host, "millrace-slow-service");
  all.insert(all.end(),
             {"--name", name, "--record", hosts_->folder() / "executions", "--log-level", "debug"});
  all.insert(all.end(), flags.begin(), flags.end());
  return all;
}

Task& Plant::service(const std::string& host, const std::string& name, const Flags& flags) {
  return run(host, name, "millrace-slow-service", of_service(host, name, flags));
}

void Plant::services(const std::string& host, const std::vector<std::string>& names,
                     const Flags& flags) {
  for (const std::string& name : names) {
    tasks_[name] = hosts_->up(host, "millrace-slow-service", of_service(host, name, flags));
  }
  for (const std::string& name : names) {
    task(name).await("^ready: ");
  }
}

std::size_t Plant::finished() const {
  // This is called often while the file grows: continue after the last line counted.
  std::ifstream file(hosts_->folder() / "executions");
  file.seekg(counted_to_);
  for (std::string line; std::getline(file, line) && !file.eof();) {
    finished_ += line.starts_with("finished ") ? 1U : 0U;
    counted_to_ = file.tellg();
  }
  return finished_;
}

std::chrono::duration<double> Plant::await_finished(std::size_t more,
                                                    std::chrono::milliseconds timeout) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t wanted = finished() + more;
  while (finished() < wanted) {
    if (std::chrono::steady_clock::now() - start > timeout) {
      throw std::runtime_error(
          fmt::format("only {} of {} calls were finished in time", finished(), wanted));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return std::chrono::steady_clock::now() - start;
}

std::vector<gateway::JournalEntry> Plant::journal() const {
  const std::filesystem::path file = hosts_->folder() / "journal" / "calls.journal";
  return std::filesystem::exists(file) ? gateway::journal::decode(read_file(file)).entries
                                       : std::vector<gateway::JournalEntry>();
}

History Plant::history() const {
  History history{.journal = journal(),
                  .executions = read_executions(hosts_->folder() / "executions"),
                  .ended_before = ended_before_};
  if (auto file = tools::mcap::FileSource::open(recording())) {
    const auto report = tools::recording::read_entries(
        *file, {},
        [&](const tools::recording::Entry& entry) { history.recording.push_back(entry); });
    EXPECT_THAT(report.problems, IsEmpty()) << "I7: the recording is not complete";
  }
  return history;
}

void Plant::expect_all_answered(std::chrono::milliseconds timeout) {
  Task& cnc = task("cnc");
  for (std::uint32_t channel = 1; channel <= load_.channels; ++channel) {
    cnc.await(fmt::format("^\\[ch{}\\] {} calls answered$", channel, load_.calls), timeout);
  }
  EXPECT_THAT(cnc.output(), Not(HasSubstr("wrong answer")));
  // The CNC goes last: the gateway still waits for the response to its last write.
  Task& gateway = task("gateway");
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
  cnc.terminate();
  EXPECT_EQ(cnc.wait(), 0);
  end_recording();
  const History all = history();
  EXPECT_THAT(all.recording, Not(IsEmpty()));
  EXPECT_THAT(violations(all), IsEmpty());
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
