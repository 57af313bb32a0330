// A chain of programs with trust, set up with the commands for it: each with its credentials from
// `millrace trust`.
//
//   TrustedChain sut;
//   sut.set_up_plant();
//   Process service = sut.square_root(sut.as("square-root"));
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "base/openssl/signed_text.hpp"
#include "fabric/trust/permissions.hpp"
#include "tests/integration/chain.hpp"

namespace millrace::tests::integration {

namespace fs = std::filesystem;

inline const std::string root_uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

inline std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class TrustedChain : public Chain {
 public:
  /// Runs the command `millrace trust` to its end.
  std::string trust(Flags command, int expected = 0) const {
    command.insert(command.begin(), {binary("millrace"), "trust"});
    Process process(std::move(command));
    EXPECT_EQ(process.wait(), expected) << process.error_output();
    return process.output() + process.error_output();
  }

  [[nodiscard]] std::string plant(const std::string& name = "plant") const {
    return (folder() / name).string();
  }

  /// Flags for a profile with the credentials of `holder`.
  [[nodiscard]] Flags as(const std::string& holder, const std::string& protection = "SIGN") const {
    return profile(plant() + "/" + holder, protection);
  }
  [[nodiscard]] Flags profile(const std::string& credentials,
                              const std::string& protection = "SIGN") const {
    const fs::path file =
        folder() / (fs::path(credentials).filename().string() + protection + ".fabric.textproto");
    std::ofstream(file) << "trust { folder: \"" << credentials << "\" protection: " << protection
                        << " }\n";
    return Flags{"--fabric-config", file.string()};
  }

  void set_up_plant() const {
    trust({"init", plant()});
    trust({"issue", plant(), "gateway-1", "--role", "gateway", "--machine", "cnc"});
    trust({"issue", plant(), "square-root", "--role", "service", "--uuid", root_uuid});
    trust({"issue", plant(), "office", "--role", "operator"});
    trust({"issue", plant(), "screen", "--role", "observer"});
    trust({"issue", plant(), "bench", "--role", "tester"});
  }

  /// A copy of a participant's folder, which gets no revocations.
  [[nodiscard]] Flags unaware(const std::string& holder) const {
    const fs::path copy = folder() / ("unaware-" + holder);
    fs::copy(fs::path(plant()) / holder, copy, fs::copy_options::recursive);
    return profile(copy.string());
  }

  /// Signs these permissions for the participant, with the validity of its certificate.
  void sign_permissions(const std::string& holder,
                        const std::vector<fabric::trust::Grant>& grants) const {
    namespace openssl = base::openssl;
    const fs::path authorities = fs::path(plant()) / "authorities";
    const fs::path folder = fs::path(plant()) / holder;
    const auto certificate =
        openssl::Certificate::read(content_of(folder / "certificate.pem")).value();
    std::ofstream(folder / "permissions.p7s") << openssl::sign_text(
        fabric::trust::permissions_document(grants, certificate.subject(), certificate.from(),
                                            certificate.until()),
        openssl::Certificate::read(content_of(authorities / "permissions.pem")).value(),
        openssl::Key::read(content_of(authorities / "permissions.key")).value());
  }

  /// Lets the participant's certificate and permissions expire in a moment; returns when.
  std::chrono::sys_seconds shorten(const fabric::trust::Participant& holder,
                                   std::chrono::seconds from_now) const {
    namespace openssl = base::openssl;
    const fs::path authorities = fs::path(plant()) / "authorities";
    const fs::path folder = fs::path(plant()) / holder.name;
    const auto read = [](const fs::path& certificate, const fs::path& key) {
      return std::pair(openssl::Certificate::read(content_of(certificate)).value(),
                       openssl::Key::read(content_of(key)).value());
    };
    const auto [identity, identity_key] =
        read(authorities / "identity.pem", authorities / "identity.key");
    const auto [old, key] = read(folder / "certificate.pem", folder / "key.pem");
    const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    const auto until = now + from_now;
    const auto brief = openssl::issue(key,
                                      {.organisation = old.organisation(),
                                       .common_name = old.common_name(),
                                       .from = now - std::chrono::minutes(1),
                                       .until = until},
                                      identity, identity_key);
    std::ofstream(folder / "certificate.pem") << brief.pem();
    sign_permissions(holder.name, fabric::trust::grants_of(holder, "millrace"));
    return until;
  }

  /// Runs a command to its end; returns its output and its errors.
  [[nodiscard]] std::string ask(Flags command, const Flags& who, int expected = 0) const {
    command.insert(command.end(), who.begin(), who.end());
    Process process = millrace(std::move(command));
    EXPECT_EQ(process.wait(), expected) << process.error_output();
    return process.output() + process.error_output();
  }
};

}  // namespace millrace::tests::integration
