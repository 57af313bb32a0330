// The credentials that `millrace trust` makes for the programs of a test.
//
//   const TrustCredentials material(folder, {uuid});
//   Process gateway({binary("millrace-gateway"), "--fabric-config", material.profile("gateway"),
//   …});
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace millrace::tests {

class TrustCredentials {
 public:
  /// Fills FOLDER/plant with three participants: "gateway" of the machine cnc, "service" of
  /// `uuids`, and "office" with the roles operator, observer and tester.
  ///
  /// @throws std::runtime_error with the command's output if it fails
  TrustCredentials(std::filesystem::path folder, const std::vector<std::string>& uuids,
                   std::string protection = "SIGN");

  /// The folder with that participant's credentials.
  [[nodiscard]] std::filesystem::path of(const std::string& holder) const {
    return folder_ / "plant" / holder;
  }
  /// A fabric.textproto for a program that is this participant, with `rest` added to it.
  [[nodiscard]] std::string profile(const std::string& holder, const std::string& rest = {}) const;

  /// The participant for a program of this name: the gateway, the operator's command, or a service.
  static std::string member_of(const std::string& program);
  /// Runs another command: {"renew", "PKI", …}, in which PKI stands for the folder.
  void run(std::vector<std::string> command) const;

 private:
  std::filesystem::path folder_;
  std::string protection_;
};

}  // namespace millrace::tests
