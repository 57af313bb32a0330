#include "tests/support/trust_credentials.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "tests/support/process.hpp"

namespace millrace::tests {

TrustCredentials::TrustCredentials(std::filesystem::path folder,
                                   const std::vector<std::string>& uuids, std::string protection)
    : folder_(std::move(folder)), protection_(std::move(protection)) {
  run({"init", "PKI"});
  run({"issue", "PKI", "gateway", "--role", "gateway", "--machine", "cnc"});
  std::vector<std::string> service{"issue", "PKI", "service", "--role", "service"};
  for (const std::string& uuid : uuids) {
    service.insert(service.end(), {"--uuid", uuid});
  }
  run(std::move(service));
  run({"issue", "PKI", "office", "--role", "operator", "--role", "observer", "--role", "tester"});
}

std::string TrustCredentials::profile(const std::string& holder, const std::string& rest) const {
  const std::filesystem::path file = folder_ / (holder + ".fabric.textproto");
  std::ofstream(file) << rest << "\ntrust { folder: \"" << of(holder).string()
                      << "\" protection: " << protection_ << " }\n";
  return file;
}

std::string TrustCredentials::member_of(const std::string& program) {
  if (program == "millrace-gateway") {
    return "gateway";
  }
  return program == "millrace" ? "office" : "service";
}

void TrustCredentials::run(std::vector<std::string> command) const {
  std::ranges::replace(command, "PKI", (folder_ / "plant").string());
  command.insert(command.begin(), {binary("millrace"), "trust"});
  Process process(std::move(command));
  if (process.wait() != 0) {
    throw std::runtime_error(process.output() + process.error_output());
  }
}

}  // namespace millrace::tests
