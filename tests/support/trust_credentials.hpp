// What `millrace trust` makes for the programs of a test, as the desk of a plant does.
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
  /// `uuids`, and "office", which operates, observes and tests.
  /// @throws std::runtime_error with what the command has said if it is not done
  TrustCredentials(std::filesystem::path folder, const std::vector<std::string>& uuids,
                   std::string protection = "SIGN");

  /// What that participant shows.
  [[nodiscard]] std::filesystem::path of(const std::string& holder) const {
    return folder_ / "plant" / holder;
  }
  /// A fabric.textproto of a program that is this participant, and otherwise says `rest`.
  [[nodiscard]] std::string profile(const std::string& holder, const std::string& rest = {}) const;

  /// The participant that a program of this name is: the gateway, the operator's command, or a
  /// service.
  static std::string member_of(const std::string& program);
  /// Another command: {"renew", "PKI", …}, in which PKI stands for the folder.
  void run(std::vector<std::string> command) const;

 private:
  std::filesystem::path folder_;
  std::string protection_;
};

}  // namespace millrace::tests
