#include "gateway/shell/certificate_alarms.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"

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
  machine.security = std::move(security);
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
  EXPECT_THAT(sut.advice, IsEmpty());
}

TEST(CertificateAlarm, WarnsInTheLastThirtyDaysWithAdvice) {
  auto sut = alarm_at(now + std::chrono::days(30));
  EXPECT_EQ(sut.level, AlarmLevel::warning);
  EXPECT_THAT(sut.text, HasSubstr("in 30 days"));
  EXPECT_THAT(sut.advice, HasSubstr("millrace controller add-route --self-signed"));
  sut = alarm_at(now + 40h);
  EXPECT_THAT(sut.text, HasSubstr("in 40 hours"));
  EXPECT_LE(sut.advice.size(), 255U);
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
  for (const auto& one : sut) {
    const bool ended = one.text.find("expired on") != std::string::npos;
    EXPECT_EQ(one.level, ended ? AlarmLevel::problem : AlarmLevel::fine) << one.text;
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
