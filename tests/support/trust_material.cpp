#include "tests/support/trust_material.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "tests/support/process.hpp"

namespace millrace::tests {

TrustMaterial::TrustMaterial(std::filesystem::path folder, const std::vector<std::string>& uuids,
                             std::string protection)
    : folder_(std::move(folder)), protection_(std::move(protection)) {
  run({"init", "PLANT"});
  run({"issue", "PLANT", "gateway", "--role", "gateway", "--machine", "cnc"});
  std::vector<std::string> service{"issue", "PLANT", "service", "--role", "service"};
  for (const std::string& uuid : uuids) {
    service.insert(service.end(), {"--uuid", uuid});
  }
  run(std::move(service));
  run({"issue", "PLANT", "office", "--role", "operator", "--role", "observer", "--role", "tester"});
}

std::string TrustMaterial::profile(const std::string& member, const std::string& rest) const {
  const std::filesystem::path file = folder_ / (member + ".fabric.textproto");
  std::ofstream(file) << rest << "\ntrust { folder: \"" << of(member).string()
                      << "\" protection: " << protection_ << " }\n";
  return file;
}

std::string TrustMaterial::member_of(const std::string& program) {
  if (program == "millrace-gateway") {
    return "gateway";
  }
  return program == "millrace" ? "office" : "service";
}

void TrustMaterial::run(std::vector<std::string> command) const {
  std::ranges::replace(command, "PLANT", (folder_ / "plant").string());
  command.insert(command.begin(), {binary("millrace"), "trust"});
  Process process(std::move(command));
  if (process.wait() != 0) {
    throw std::runtime_error(process.output() + process.error_output());
  }
}

}  // namespace millrace::tests
