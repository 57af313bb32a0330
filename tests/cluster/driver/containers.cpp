#include "tests/cluster/driver/containers.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "tests/cluster/driver/shell.hpp"

namespace millrace::tests::cluster {

namespace {

/// The network namespace of the engine.
std::string engine_namespace() {
  const std::filesystem::path engine = std::getenv("MILLRACE_ENGINE");
  std::string file;
  std::getline(std::ifstream(engine / "namespace"), file);
  if (file.empty()) {
    throw std::runtime_error(fmt::format("{} holds no engine", engine.string()));
  }
  return std::filesystem::path(file).filename();
}

struct Image {
  std::string name;
  /// The image has the program itself; test programs come from this build.
  bool complete = true;
};

Image image_of(const std::string& program) {
  static const std::map<std::string, Image> images{
      {"millrace", {"millrace/tools"}},
      {"millrace-cnc", {"millrace/cnc"}},
      {"millrace-gateway", {"millrace/gateway"}},
      {"millrace-slow-service", {"millrace/services", false}}};
  const auto image = images.find(program);
  return image == images.end() ? Image{"millrace/services"} : image->second;
}

/// `docker run` in the foreground.
class ContainerTask : public Task {
 public:
  ContainerTask(std::string name, std::vector<std::string> command)
      : Task(std::move(command)), name_(std::move(name)) {}
  ~ContainerTask() override {
    Process remove({"/usr/bin/env", "docker", "rm", "--force", name_});
    remove.wait();
  }
  ContainerTask(const ContainerTask&) = delete;
  ContainerTask& operator=(const ContainerTask&) = delete;

  void kill() override {
    // Directly, not through the engine, so that the moment of the crash is known.
    ::kill(pid(), SIGKILL);
    wait();
  }
  void terminate() override { run({"docker", "kill", "--signal", "TERM", name_}); }
  [[nodiscard]] pid_t pid() const override {
    return std::stoi(run({"docker", "inspect", "--format", "{{.State.Pid}}", name_}));
  }

 private:
  const std::string name_;
};

}  // namespace

Containers::Containers(const std::vector<std::string>& names, std::uint64_t seed)
    : Hosts(names),
      network_namespace_(engine_namespace()),
      project_(fmt::format("millrace-cluster-{}", ::getpid())) {
  std::filesystem::permissions(folder(), std::filesystem::perms::all);
  std::vector<Port> ports;
  for (const std::string& name : names) {
    const std::size_t number = ports.size() + 1;
    bridges_[name] = fmt::format("host-{}", number);
    ports.push_back({name, std::filesystem::path("/run/netns") / network_namespace_,
                     fmt::format("port-{}", number)});
  }
  write_compose_file(names);
  try {
    compose({"up", "--detach", "--no-build"});
    network_.emplace(ports, seed);
    for (const Port& port : ports) {
      connect(port);
    }
  } catch (...) {
    remove_all();
    throw;
  }
}

Containers::~Containers() {
  network_.reset();
  remove_all();
}

std::string Containers::container(const std::string& host) const {
  return project_ + "-" + host;
}

void Containers::write_compose_file(const std::vector<std::string>& names) const {
  std::ofstream file(folder() / "hosts.yml");
  file << "services:\n";
  for (const std::string& name : names) {
    file << fmt::format(R"(  {}:
    container_name: {}
    image: millrace/services
    command: [sleep, infinity]
    init: true
    healthcheck: {{disable: true}}
    networks: {{default: {{ipv4_address: {}}}}}
)",
                        name, container(name), address(name));
  }
  // No host may have the bridge's own address.
  file << "networks:\n  default:\n    ipam:\n      config:\n"
          "        - {subnet: 10.77.0.0/24, gateway: 10.77.0.254}\n";
}

void Containers::compose(std::vector<std::string> arguments) const {
  std::vector<std::string> command{"docker-compose", "--project-name", project_, "--file",
                                   folder() / "hosts.yml"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  run(command);
}

void Containers::connect(const Port& port) {
  const auto ip = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"ip", "-n", network_namespace_});
    return run(arguments);
  };
  // The other end of the container's eth0 is a device here: "7: veth1234@if6: …".
  std::string index =
      run({"docker", "exec", container(port.host), "cat", "/sys/class/net/eth0/iflink"});
  index.resize(index.find_last_not_of('\n') + 1);
  const std::string links = ip({"-oneline", "link"});
  std::smatch match;
  if (!std::regex_search(links, match, std::regex("(?:^|\n)" + index + ": ([^@:]+)"))) {
    throw std::runtime_error(fmt::format("{} has no end of its cable", port.host));
  }
  const std::string& bridge = bridges_.at(port.host);
  ip({"link", "add", bridge, "type", "bridge", "mcast_snooping", "0", "forward_delay", "0"});
  for (const std::string& end : {match[1].str(), port.device}) {
    ip({"link", "set", end, "master", bridge});
    ip({"link", "set", end, "up"});
  }
  ip({"link", "set", bridge, "up"});
}

void Containers::remove_all() noexcept {
  const auto done = [](const auto& step) {
    try {
      step();
      return true;
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      return false;
    }
  };
  const auto down = [&] { compose({"down", "--timeout", "0"}); };
  if (!done(down)) {
    // On a busy host the engine may keep the network's endpoint of a container that it has removed.
    // The next test needs the network's addresses.
    for (const auto& [host, bridge] : bridges_) {
      done([&] {
        run({"docker", "network", "disconnect", "--force", project_ + "_default", container(host)});
      });
    }
    done(down);
  }
  for (const auto& [host, bridge] : bridges_) {
    done([&] { run({"ip", "-n", network_namespace_, "link", "delete", bridge}); });
  }
}

std::unique_ptr<Task> Containers::up(const std::string& host, const std::string& program,
                                     const std::vector<std::string>& arguments) {
  const std::string name = fmt::format("{}-task-{}", project_, ++tasks_);
  const Image image = image_of(program);
  std::vector<std::string> command{"/usr/bin/env",
                                   "docker",
                                   "run",
                                   "--name",
                                   name,
                                   "--network",
                                   "container:" + container(host),
                                   "--read-only",
                                   "--cap-drop",
                                   "ALL",
                                   "--security-opt",
                                   "no-new-privileges",
                                   "--no-healthcheck",
                                   "--volume",
                                   fmt::format("{0}:{0}", folder().string())};
  std::string file = program;
  if (!image.complete) {
    file = binary(program);
    command.insert(command.end(), {"--volume", fmt::format("{0}:{0}:ro", file)});
  }
  command.insert(command.end(), {"--entrypoint", file, image.name});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return std::make_unique<ContainerTask>(name, std::move(command));
}

std::string Containers::obstacle() {
  if (std::getenv("MILLRACE_ENGINE") == nullptr) {
    return "there is no engine; docker/test starts this test with one";
  }
  return {};
}

}  // namespace millrace::tests::cluster
