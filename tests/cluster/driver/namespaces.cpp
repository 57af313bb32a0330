#include "tests/cluster/driver/namespaces.hpp"

#include <cstdio>
#include <regex>

#include <fmt/format.h>
#include <unistd.h>

#include "tests/cluster/driver/shell.hpp"

namespace millrace::tests::cluster {

namespace {

const std::filesystem::path all_namespaces = "/run/netns";
/// The device of each host, as in the profiles.
constexpr const char* device = "eth0";

/// Namespaces of runs whose process is gone.
void remove_leftovers() {
  if (!std::filesystem::exists(all_namespaces)) {
    return;
  }
  const std::regex namespace_of_run("millrace-(\\d+)-.*");
  for (const auto& entry : std::filesystem::directory_iterator(all_namespaces)) {
    const std::string name = entry.path().filename();
    std::smatch match;
    if (std::regex_match(name, match, namespace_of_run) &&
        !std::filesystem::exists("/proc/" + match[1].str())) {
      run({"ip", "netns", "delete", name});
    }
  }
}

}  // namespace

Namespaces::Namespaces(const std::vector<std::string>& names, std::uint64_t seed)
    : Hosts(names), prefix_(fmt::format("millrace-{}-", ::getpid())), names_(names) {
  remove_leftovers();
  std::vector<Port> ports;
  try {
    for (const std::string& name : names) {
      make_namespace(name);
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
  for (const std::string& host : names_) {
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
  // `ip netns exec` becomes the program, so its id is the program's.
  return std::make_unique<Task>(std::move(command));
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
  // Tried once: a plain container, or a root user that may not mount, has namespaces and cannot use
  // them.
  static const std::string trial = [] {
    const std::string name = fmt::format("millrace-{}-trial", ::getpid());
    std::string failure;
    try {
      run({"ip", "netns", "add", name});
      run({"ip", "netns", "exec", name, "true"});
    } catch (const std::exception& error) {
      failure = std::string("network namespaces cannot be used here: ") + error.what();
    }
    try {
      run({"ip", "netns", "delete", name});
    } catch (const std::exception&) {
      // It was not made.
    }
    return failure;
  }();
  return trial;
}

}  // namespace millrace::tests::cluster
