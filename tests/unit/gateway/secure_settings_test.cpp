#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/program/command_line.hpp"
#include "gateway/settings/settings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::gateway {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Writes gateway.textproto and the files it names into a folder.
class SecureSettings : public testing::Test {
 protected:
  SecureSettings() { write("press.psk", "secret\nanother line\n"); }

  void write(const std::string& name, const std::string& text, bool secret = true) {
    std::ofstream(folder.path() / name) << text;
    fs::permissions(folder.path() / name,
                    secret ? fs::perms(0640) : fs::perms(0644));  // NOLINT: as chmod has it
  }
  settings::MachineSettings read(const std::string& secure, const std::string& rest = {}) {
    write("gateway.textproto",
          "machine { name: \"press\" host: \"CX-123456\" net_id: \"10.0.0.5.1.1\" " + rest +
              " secure { " + secure + " } }");
    return settings::read_settings(folder.path() / "gateway.textproto").machines.at(0);
  }
  std::string mistake(const std::string& secure) {
    try {
      read(secure);
    } catch (const base::program::UsageError& error) {
      return error.what();
    }
    return "no mistake";
  }
  /// An RSA key and its certificate.
  void write_certificate() {
    static const auto key = base::openssl::Key::generate_rsa();
    write("press.key", key.pem());
    write("press.crt",
          base::openssl::self_signed(
              key, {.organisation = "o", .common_name = "c", .from = {}, .until = {}})
              .pem(),
          false);
  }

  tests::TemporaryFolder folder;
};

constexpr const char* psk = "psk { identity: \"millrace\" password_file: \"press.psk\" }";

TEST_F(SecureSettings, HaveThePasswordOfTheFirstLine) {
  const auto sut = read(psk);
  EXPECT_EQ(sut.security, cnc::ads::Security(cnc::ads::Psk{"millrace", "secret"}));
  EXPECT_EQ(sut.tcp_port, 8016);
  EXPECT_EQ(sut.to_string(), "press (CX-123456:8016, 10.0.0.5.1.1, Secure ADS)");
  EXPECT_FALSE(sut.is_open_to_the_network());
}

TEST_F(SecureSettings, MayHaveAnotherPort) {
  EXPECT_EQ(read(psk, "port: 18016").tcp_port, 18016);
}

TEST_F(SecureSettings, AreOthersWhenAFileHasChanged) {
  const auto before = read(psk);
  write("press.psk", "another");
  EXPECT_NE(read(psk), before);
}

TEST_F(SecureSettings, RefuseASecretThatAnyUserCanRead) {
  write("press.psk", "secret", false);
  EXPECT_THAT(mistake(psk),
              HasSubstr("press.psk is a secret, and all users of this host can read"));
  EXPECT_THAT(mistake(psk), HasSubstr("gateway.textproto:1:"));
}

TEST_F(SecureSettings, RefuseWhatOthersCanWriteAndWhatIsNoFile) {
  write_certificate();
  const auto allow = [this](const char* name, unsigned mode) {
    fs::permissions(folder.path() / name, fs::perms(mode));
  };
  allow("press.psk", 0660);
  EXPECT_THAT(mistake(psk), HasSubstr("its group can write it"));
  allow("press.crt", 0646);
  EXPECT_THAT(
      mistake("shared_ca { ca: \"press.crt\" certificate: \"press.crt\" key: \"press.key\" }"),
      HasSubstr("press.crt all users of this host can write it: `chmod go-w"));
  EXPECT_THAT(mistake("psk { identity: \"millrace\" password_file: \".\" }"),
              HasSubstr("is not a regular file"));
}

TEST_F(SecureSettings, NameAMissingFile) {
  EXPECT_THAT(mistake("psk { identity: \"millrace\" password_file: \"none\" }"),
              HasSubstr("none cannot be read (No such file or directory)"));
}

TEST_F(SecureSettings, RefuseAnIdentityThatIsNotAscii) {
  EXPECT_THAT(mistake("psk { identity: \"mühle\" password_file: \"press.psk\" }"),
              HasSubstr("ASCII characters without blanks"));
}

TEST_F(SecureSettings, AreOfOneModeAlone) {
  EXPECT_THAT(mistake(""), HasSubstr("has 0 of psk, self_signed and shared_ca"));
  EXPECT_THAT(mistake(std::string(psk) + " shared_ca { }"), HasSubstr("has 2 of psk"));
}

TEST_F(SecureSettings, HaveCertificateKeyAndFingerprint) {
  write_certificate();
  const std::string hex(64, 'a');
  const auto sut = read(
      "self_signed { certificate: \"press.crt\" key: \"press.key\" fingerprint: \"" + hex + "\" }");
  const auto& shown = std::get<cnc::ads::SelfSigned>(*sut.security);
  EXPECT_THAT(shown.fingerprint, testing::StartsWith("AA:AA:"));
  EXPECT_THAT(shown.key, HasSubstr("PRIVATE KEY"));
}

TEST_F(SecureSettings, RefuseAnInvalidFingerprint) {
  write_certificate();
  EXPECT_THAT(
      mistake("self_signed { certificate: \"press.crt\" key: \"press.key\" fingerprint: \"AB\" }"),
      HasSubstr("expected the SHA-256 fingerprint"));
}

TEST_F(SecureSettings, ExpectTheHostAsCommonNameOfASharedCa) {
  write_certificate();
  const auto sut =
      read("shared_ca { ca: \"press.crt\" certificate: \"press.crt\" key: \"press.key\" }");
  EXPECT_EQ(std::get<cnc::ads::SharedCa>(*sut.security).common_name, "CX-123456");
}

TEST_F(SecureSettings, RefuseAKeyOfAnotherCertificate) {
  write_certificate();
  write("press.key", base::openssl::Key::generate_rsa().pem());
  EXPECT_THAT(
      mistake("shared_ca { ca: \"press.crt\" certificate: \"press.crt\" key: \"press.key\" }"),
      HasSubstr("the key does not belong to the certificate"));
}

TEST_F(SecureSettings, ReadCredentialsOfSystemd) {
  ::setenv("CREDENTIALS_DIRECTORY", folder.path().c_str(), 1);
  const auto sut =
      read("psk { identity: \"millrace\" password_file: \"$CREDENTIALS_DIRECTORY/press.psk\" }");
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_EQ(std::get<cnc::ads::Psk>(*sut.security).password, "secret");
  EXPECT_THAT(
      mistake("psk { identity: \"millrace\" password_file: \"$CREDENTIALS_DIRECTORY/press.psk\" }"),
      HasSubstr("LoadCredential=NAME:FILE"));
}

TEST(PlainAds, IsOpenToTheNetworkUnlessItStaysOnThisHost) {
  EXPECT_FALSE(settings::MachineSettings().is_open_to_the_network());
  settings::MachineSettings sut;
  sut.host = "192.168.10.5";
  EXPECT_TRUE(sut.is_open_to_the_network());
}

}  // namespace
}  // namespace millrace::gateway
