#include "tests/integration/chain.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "tests/support/data.hpp"

namespace millrace::tests::integration {

namespace {

std::string replaced(std::string text, const std::string& mark, const std::string& value) {
  for (auto at = text.find(mark); at != std::string::npos; at = text.find(mark)) {
    text.replace(at, mark.size(), value);
  }
  return text;
}

}  // namespace

void Chain::with_trust(const std::vector<std::string>& uuids, const std::string& protection) {
  trust_.emplace(folder(), uuids, protection);
}

Flags Chain::joining(const std::string& name) const {
  Flags flags{"--domain", std::to_string(domain_.number())};
  if (trust_) {
    flags.insert(flags.end(),
                 {"--fabric-config", trust_->profile(TrustCredentials::member_of(name))});
  }
  return flags;
}

Process Chain::start(const std::string& name, Flags command) {
  command.insert(command.begin(), binary(name));
  Process process(std::move(command), state_home_);
  process.await("^ready: ");
  return process;
}

Process Chain::cnc(const Flags& flags) {
  Flags command{"--listen", "127.0.0.1:0", "--dir", folder_.path().string()};
  if (std::ranges::find(flags, "--channels") == flags.end()) {
    command.insert(command.end(), {"--channels", "2"});
  }
  command.insert(command.end(), flags.begin(), flags.end());
  Process process = start("millrace-cnc", std::move(command));
  port_ = process.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);
  return process;
}

Process Chain::gateway(const Flags& flags) {
  Flags command = joining("millrace-gateway");
  command.insert(command.end(), {"--machine", "cnc=127.0.0.1:" + port_ + "/127.0.0.1.1.1"});
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-gateway", std::move(command));
}

void Chain::configure(std::string configuration) {
  std::ofstream(this->configuration()) << replaced(std::move(configuration), "@PORT@", port_);
}

Process Chain::configured_gateway(const std::string& configuration, const Flags& flags) {
  configure(configuration);
  Flags command = joining("millrace-gateway");
  command.insert(command.end(), {"--config", this->configuration().string()});
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-gateway", std::move(command));
}

namespace {

/// Tests search for calls in the log of a service.
void log_each_call(Flags& command, const Flags& flags) {
  if (std::ranges::find(flags, "--log-level") == flags.end()) {
    command.insert(command.end(), {"--log-level", "debug"});
  }
}

}  // namespace

Process Chain::slow_service(const Flags& flags) {
  Flags command = joining("millrace-slow-service");
  command.insert(command.end(), {"--record", record().string()});
  log_each_call(command, flags);
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-slow-service", std::move(command));
}

Process Chain::square_root(const Flags& flags) {
  Flags command = joining("millrace-square-root");
  log_each_call(command, flags);
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-square-root", std::move(command));
}

Process Chain::stand_in(const Flags& flags) {
  Flags command{"replay",      "--as-cnc", "--listen",
                "127.0.0.1:0", "--domain", std::to_string(domain())};
  command.insert(command.end(), flags.begin(), flags.end());
  Process process = start("millrace", std::move(command));
  port_ = process.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);
  return process;
}

Process Chain::millrace(Flags command) const {
  return Process(Chain::command(std::move(command)));
}

Flags Chain::command(Flags command) const {
  command.insert(command.begin(), binary("millrace"));
  const std::string& what = command.at(1);
  if (what != "recording" && what != "completion") {
    const Flags join = joining("millrace");
    command.insert(command.end(), join.begin(), join.end());
  }
  return command;
}

std::string Chain::program(int channel, const std::string& file) {
  return std::to_string(channel) + "=" + test_data("nc/chain/" + file).string();
}

std::string Chain::counting_program(const std::string& uuid, std::uint32_t calls) const {
  std::ostringstream text;
  text << std::ifstream(test_data("nc/cluster/counting.nc")).rdbuf();
  const std::filesystem::path file = folder_.path() / "counting.nc";
  std::ofstream(file) << replaced(replaced(text.str(), "@UUID@", uuid), "@CALLS@",
                                  std::to_string(calls));
  return file;
}

}  // namespace millrace::tests::integration
