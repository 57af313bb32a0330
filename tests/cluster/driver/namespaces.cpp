#include "tests/cluster/driver/namespaces.hpp"

#include <csignal>
#include <cstdio>
#include <regex>

#include <fmt/format.h>
#include <unistd.h>

#include "tests/cluster/driver/shell.hpp"

namespace millrace::tests::cluster {

namespace {

const std::filesystem::path all_namespaces = "/run/netns";
/// Of each host, as the profiles name it.
constexpr const char* device = "eth0";

/// A process in a network namespace: `ip netns exec` becomes the program, so its id is the
/// program's.
class NamespaceTask : public Task {
 public:
  explicit NamespaceTask(std::vector<std::string> command) : process_(std::move(command)) {}

  std::vector<std::string> await(const std::string& pattern,
                                 std::chrono::milliseconds timeout) override {
    return process_.await(pattern, timeout);
  }
  std::vector<std::string> await_log(const std::string& pattern,
                                     std::chrono::milliseconds timeout) override {
    return process_.await_error(pattern, timeout);
  }
  [[nodiscard]] std::string output() const override { return process_.output(); }
  [[nodiscard]] std::string log() const override { return process_.error_output(); }
  void kill() override { process_.kill(); }
  void terminate() override { process_.terminate(); }
  void pause() override { process_.signal(SIGSTOP); }
  void resume() override { process_.signal(SIGCONT); }
  [[nodiscard]] pid_t pid() const override { return process_.pid(); }
  int wait(std::chrono::milliseconds timeout) override { return process_.wait(timeout); }

 private:
  Process process_;
};

/// Namespaces of runs whose process is gone.
void remove_leftovers() {
  if (!std::filesystem::exists(all_namespaces)) {
    return;
  }
  const std::regex ours("millrace-(\\d+)-.*");
  for (const auto& entry : std::filesystem::directory_iterator(all_namespaces)) {
    const std::string name = entry.path().filename();
    std::smatch match;
    if (std::regex_match(name, match, ours) &&
        !std::filesystem::exists("/proc/" + match[1].str())) {
      run({"ip", "netns", "delete", name});
    }
  }
}

}  // namespace

Namespaces::Namespaces(const std::vector<std::string>& names, std::uint64_t seed)
    : prefix_(fmt::format("millrace-{}-", ::getpid())) {
  remove_leftovers();
  std::vector<Port> ports;
  try {
    for (const std::string& name : names) {
      make_namespace(name);
      addresses_[name] = fmt::format("10.77.0.{}", ports.size() + 1);
      ports.push_back({name, all_namespaces / network_namespace(name), device});
    }
    network_.emplace(std::move(ports), seed);
    for (const std::string& name : names) {
      configure(name);
    }
  } catch (...) {
    remove_all();
    throw;
  }
}

Namespaces::~Namespaces() {
  network_.reset();
  remove_all();
}

std::string Namespaces::network_namespace(const std::string& host) const {
  return prefix_ + host;
}

void Namespaces::make_namespace(const std::string& host) {
  run({"ip", "netns", "add", network_namespace(host)});
}

void Namespaces::configure(const std::string& host) {
  const std::string name = network_namespace(host);
  run({"ip", "-n", name, "link", "set", "lo", "up"});
  run({"ip", "-n", name, "address", "add", address(host) + "/24", "dev", device});
  run({"ip", "-n", name, "link", "set", device, "up"});
}

void Namespaces::remove_all() noexcept {
  for (const auto& [host, address] : addresses_) {
    try {
      run({"ip", "netns", "delete", network_namespace(host)});
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
    }
  }
}

std::unique_ptr<Task> Namespaces::up(const std::string& host, const std::string& program,
                                     const std::vector<std::string>& arguments) {
  std::vector<std::string> command{"/usr/bin/env",          "ip",           "netns", "exec",
                                   network_namespace(host), binary(program)};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return std::make_unique<NamespaceTask>(std::move(command));
}

std::string Namespaces::address(const std::string& host) const {
  return addresses_.at(host);
}

std::string Namespaces::obstacle() {
  if (::geteuid() != 0) {
    return "network namespaces need root";
  }
  if (!exists("ip")) {
    return "ip is not installed (package iproute2)";
  }
  if (!std::filesystem::exists("/dev/net/tun")) {
    return "this kernel has no TAP devices (/dev/net/tun)";
  }
  return {};
}

}  // namespace millrace::tests::cluster
