#include "tests/integration/chain.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace millrace::tests::integration {

namespace {

std::string replaced(std::string text, const std::string& mark, const std::string& value) {
  for (auto at = text.find(mark); at != std::string::npos; at = text.find(mark)) {
    text.replace(at, mark.size(), value);
  }
  return text;
}

}  // namespace

Process Chain::start(const std::string& name, Flags command) {
  command.insert(command.begin(), binary(name));
  Process process(std::move(command));
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
  Flags command{"--domain", std::to_string(domain_.number()), "--machine",
                "cnc=127.0.0.1:" + port_ + "/127.0.0.1.1.1"};
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-gateway", std::move(command));
}

void Chain::configure(std::string configuration) {
  std::ofstream(this->configuration()) << replaced(std::move(configuration), "@PORT@", port_);
}

Process Chain::configured_gateway(const std::string& configuration, const Flags& flags) {
  configure(configuration);
  Flags command{"--domain", std::to_string(domain_.number()), "--config",
                this->configuration().string()};
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-gateway", std::move(command));
}

Process Chain::slow_service(const Flags& flags) {
  Flags command{"--domain", std::to_string(domain_.number()), "--record", record().string()};
  command.insert(command.end(), flags.begin(), flags.end());
  return start("millrace-slow-service", std::move(command));
}

Process Chain::square_root(const Flags& flags) {
  Flags command{"--domain", std::to_string(domain_.number())};
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
  if (what != "log" && what != "completion") {
    command.insert(command.end(), {"--domain", std::to_string(domain_.number())});
  }
  return command;
}

std::string Chain::program(int channel, const std::string& file) {
  return std::to_string(channel) + "=" + MILLRACE_TEST_DATA "/nc/chain/" + file;
}

std::string Chain::counting_program(const std::string& uuid, std::uint32_t calls) const {
  std::ostringstream text;
  text << std::ifstream(MILLRACE_TEST_DATA "/nc/cluster/counting.nc").rdbuf();
  const std::filesystem::path file = folder_.path() / "counting.nc";
  std::ofstream(file) << replaced(replaced(text.str(), "@UUID@", uuid), "@CALLS@",
                                  std::to_string(calls));
  return file;
}

}  // namespace millrace::tests::integration
