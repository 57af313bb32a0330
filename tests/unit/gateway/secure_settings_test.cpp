#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/program/command_line.hpp"
#include "gateway/settings/settings.hpp"
#include "gateway/shell/alarms.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::gateway::shell {
namespace {

using fabric::AlarmLevel;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

constexpr std::chrono::sys_seconds now =
    std::chrono::sys_days{std::chrono::year{2026} / 3 / 1} + 7h;

std::string certificate(const std::string& name, std::chrono::sys_seconds until) {
  static const auto key = base::openssl::Key::generate();
  return base::openssl::self_signed(key, {.organisation = "millrace",
                                          .common_name = name,
                                          .from = now - std::chrono::days(400),
                                          .until = until})
      .pem();
}

settings::MachineSettings machine(const std::string& name, cnc::ads::Security security) {
  settings::MachineSettings machine;
  machine.name = name;
  machine.controller.security = std::move(security);
  return machine;
}

/// The alarm of a machine whose own certificate expires then.
fabric::Alarm alarm_at(std::chrono::sys_seconds until) {
  return certificate_alarms(
             {machine("press", cnc::ads::SelfSigned{certificate("hall", until), {}, {}})}, now)
      .at(0);
}

TEST(CertificateAlarm, ShowsWhenTheCertificateExpires) {
  const auto sut = alarm_at(now + std::chrono::days(31));
  EXPECT_EQ(sut.level, AlarmLevel::fine);
  EXPECT_EQ(
      sut.text,
      "the certificate \"hall\" for Secure ADS with press expires on 2026-04-01 07:00 UTC, in "
      "31 days");
  EXPECT_THAT(sut.advice.text, IsEmpty());
}

TEST(CertificateAlarm, WarnsInTheLastThirtyDaysWithAdvice) {
  auto sut = alarm_at(now + std::chrono::days(30));
  EXPECT_EQ(sut.level, AlarmLevel::warning);
  EXPECT_THAT(sut.text, HasSubstr("in 30 days"));
  EXPECT_THAT(sut.advice, HasSubstr("millrace controller add-route --self-signed"));
  sut = alarm_at(now + 40h);
  EXPECT_THAT(sut.text, HasSubstr("in 40 hours"));
  EXPECT_LE(sut.advice.text.size(), 255U);
}

TEST(CertificateAlarm, WarnsOfAnExpiredCertificate) {
  const auto sut = alarm_at(now - 1h);
  EXPECT_EQ(sut.level, AlarmLevel::warning) << "fingerprints have no dates";
  EXPECT_THAT(sut.text, HasSubstr("expired on 2026-03-01 06:00 UTC"));
}

TEST(CertificateAlarm, IsAProblemOnceTheCertificateOrTheCaHasEnded) {
  const auto good = now + std::chrono::days(90);
  const auto sut = certificate_alarms(
      {machine("press",
               cnc::ads::SharedCa{
                   certificate("plant", now - 1h), certificate("hall", good), {}, "CX-123456"}),
       machine("saw",
               cnc::ads::SharedCa{
                   certificate("works", good), certificate("office", now - 1h), {}, "CX-7"})},
      now);
  ASSERT_EQ(sut.size(), 4U);
  for (const auto& alarm : sut) {
    const bool ended = alarm.text.text.find("expired on") != std::string::npos;
    EXPECT_EQ(alarm.level, ended ? AlarmLevel::problem : AlarmLevel::fine) << alarm.text.text;
  }
  EXPECT_EQ(std::ranges::count(sut, AlarmLevel::problem, &fabric::Alarm::level), 2);
}

TEST(CertificateAlarm, IsOneForAllMachinesOfACertificate) {
  const auto same = certificate("hall", now + std::chrono::days(90));
  const auto sut = certificate_alarms(
      {machine("press", cnc::ads::SelfSigned{same, {}, "AB"}),
       machine("saw", cnc::ads::SelfSigned{same, {}, "CD"}),
       machine("mill", cnc::ads::Psk{"millrace", "secret"}), settings::MachineSettings()},
      now);
  ASSERT_EQ(sut.size(), 1U);
  EXPECT_THAT(sut[0].text, HasSubstr("with press, saw expires"));
}

TEST(CertificateAlarm, ShowsTheExpiryAlsoWhereManyMachinesShareTheCertificate) {
  const auto same = certificate(std::string(64, 'h'), now + std::chrono::days(90));
  std::vector<settings::MachineSettings> machines;
  for (int number = 1; number <= 30; ++number) {
    machines.push_back(
        machine(fmt::format("press_{}", number), cnc::ads::SelfSigned{same, {}, {}}));
  }
  const std::string sut = certificate_alarms(machines, now).at(0).text;
  EXPECT_THAT(sut, HasSubstr("with press_1, press_2, press_3 and 27 more expires on"));
  EXPECT_LE(sut.size(), 255U);
}

TEST(CertificateAlarm, KeepsItsSubject) {
  const auto pem = certificate("hall", now + std::chrono::days(31));
  const std::vector machines{machine("press", cnc::ads::SelfSigned{pem, {}, {}})};
  EXPECT_EQ(certificate_alarms(machines, now).at(0).key,
            certificate_alarms(machines, now + std::chrono::days(9)).at(0).key);
}

}  // namespace
}  // namespace millrace::gateway::shell

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
  EXPECT_EQ(sut.controller.security, cnc::ads::Security(cnc::ads::Psk{"millrace", "secret"}));
  EXPECT_EQ(sut.controller.tcp_port, 8016);
  EXPECT_EQ(sut.to_string(), "press (CX-123456:8016, 10.0.0.5.1.1, Secure ADS)");
  EXPECT_FALSE(sut.is_open_to_the_network());
}

TEST_F(SecureSettings, MayHaveAnotherPort) {
  EXPECT_EQ(read(psk, "port: 18016").controller.tcp_port, 18016);
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
  const auto& shown = std::get<cnc::ads::SelfSigned>(*sut.controller.security);
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
  EXPECT_EQ(std::get<cnc::ads::SharedCa>(*sut.controller.security).common_name, "CX-123456");
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
  EXPECT_EQ(std::get<cnc::ads::Psk>(*sut.controller.security).password, "secret");
  EXPECT_THAT(
      mistake("psk { identity: \"millrace\" password_file: \"$CREDENTIALS_DIRECTORY/press.psk\" }"),
      HasSubstr("LoadCredential=NAME:FILE"));
}

TEST(PlainAds, IsOpenToTheNetworkUnlessItStaysOnThisHost) {
  EXPECT_FALSE(settings::MachineSettings().is_open_to_the_network());
  settings::MachineSettings sut;
  sut.controller.host = "192.168.10.5";
  EXPECT_TRUE(sut.is_open_to_the_network());
}

}  // namespace
}  // namespace millrace::gateway
