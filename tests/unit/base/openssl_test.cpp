#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "base/openssl/revocations.hpp"
#include "base/openssl/signed_text.hpp"

namespace millrace::base::openssl {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr Time from{1'700'000'000s};
constexpr Time until = from + 24h;

struct Authority {
  Key key = Key::generate();
  Certificate certificate = self_signed(
      key, {.organisation = "plant", .common_name = "authority", .from = from, .until = until});
};

TEST(Fingerprint, IsReadInAnyNotation) {
  const Key key = Key::generate_rsa();
  const Certificate sut = self_signed(
      key, {.organisation = "plant", .common_name = "cnc", .from = Time(), .until = Time()});
  const std::string text = sut.fingerprint();
  EXPECT_EQ(text.size(), 95U);
  EXPECT_EQ(parse_fingerprint(text), text);
  std::string lower;
  for (const char c : text) {
    if (c != ':') {
      lower += static_cast<char>(std::tolower(c));
    }
  }
  EXPECT_EQ(parse_fingerprint(lower), text);
  EXPECT_FALSE(parse_fingerprint(lower + "0"));
  EXPECT_FALSE(parse_fingerprint("AB:CD"));
  EXPECT_FALSE(parse_fingerprint(lower.substr(1) + "g"));
}

TEST(Key, IsReadAsItWasWritten) {
  const Key sut = Key::generate();
  const auto read = Key::read(sut.pem());
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->pem(), sut.pem());
}

TEST(Key, OpensWithItsPassphraseOnly) {
  const std::string sut = Key::generate().pem("open sesame");
  EXPECT_THAT(sut, HasSubstr("ENCRYPTED"));
  EXPECT_TRUE(Key::read(sut, "open sesame"));
  EXPECT_THAT(Key::read(sut).error(), HasSubstr("no passphrase is given"));
  EXPECT_THAT(Key::read(sut, "open barley").error(), HasSubstr("does not open"));
}

TEST(Key, IsNoText) {
  EXPECT_THAT(Key::read("").error(), HasSubstr("not a private key"));
  EXPECT_THAT(Key::read("-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n").error(),
              HasSubstr("not a private key"));
}

TEST(Certificate, HasItsSubjectAndItsValidity) {
  const Authority authority;
  const Key key = Key::generate();
  const Certificate sut = issue(
      key, {.organisation = "plant", .common_name = "gateway-1", .from = from, .until = until},
      authority.certificate, authority.key);
  const auto read = Certificate::read(sut.pem());
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->subject(), "CN=gateway-1,O=plant");
  EXPECT_EQ(read->common_name(), "gateway-1");
  EXPECT_EQ(read->organisation(), "plant");
  EXPECT_EQ(read->from(), from);
  EXPECT_EQ(read->until(), until);
  EXPECT_EQ(read->serial(), sut.serial());
  EXPECT_TRUE(read->belongs_to(key));
  EXPECT_FALSE(read->belongs_to(authority.key));
}

TEST(Certificate, VerifiesWithItsOwnCaOnly) {
  const Authority authority;
  const Authority another;
  const Certificate sut = issue(
      Key::generate(), {.organisation = "plant", .common_name = "x", .from = from, .until = until},
      authority.certificate, authority.key);
  EXPECT_TRUE(sut.is_issued_by(authority.certificate));
  // The same name, with another key.
  EXPECT_FALSE(sut.is_issued_by(another.certificate));
}

TEST(Certificate, OfAParticipantIssuesNoOthers) {
  const Authority authority;
  const Key key = Key::generate();
  const Subject subject{.organisation = "plant", .common_name = "x", .from = from, .until = until};
  const Certificate member = issue(key, subject, authority.certificate, authority.key);
  const Certificate sut = issue(Key::generate(), subject, member, key);
  EXPECT_FALSE(sut.is_issued_by(member));
}

TEST(Certificate, RefusesASubjectThatX509CannotHold) {
  EXPECT_THROW(
      self_signed(
          Key::generate(),
          {.organisation = std::string(65, 'o'), .common_name = "x", .from = from, .until = until}),
      std::invalid_argument);
}

TEST(Revocations, ContainExactlyTheRevokedCertificates) {
  const Authority authority;
  const auto member = [&] {
    return issue(Key::generate(),
                 {.organisation = "plant", .common_name = "x", .from = from, .until = until},
                 authority.certificate, authority.key);
  };
  const Certificate good = member();
  const Certificate bad = member();
  const auto sut = RevocationList::read(revocation_list(
      {{bad.serial(), from + 1h}}, authority.certificate, authority.key, from, until));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_TRUE(sut->names(bad));
  EXPECT_FALSE(sut->names(good));
  EXPECT_TRUE(sut->is_issued_by(authority.certificate));
  EXPECT_FALSE(sut->is_issued_by(Authority().certificate));
}

TEST(Revocations, NoteWhoseTheCertificatesWere) {
  const Authority authority;
  const auto sut = RevocationList::read(
      revocation_list({{"1A", from, "square-root"}, {"1B", from}, {"1C", from, "B\xC3\xBCro"}},
                      authority.certificate, authority.key, from, until));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->common_names(), (std::set<std::string>{"B\xC3\xBCro", "square-root"}));
  EXPECT_TRUE(sut->is_issued_by(authority.certificate));
}

TEST(Revocations, AreOfSerialNumbers) {
  const Authority authority;
  EXPECT_THROW(
      revocation_list({{"no number", from}}, authority.certificate, authority.key, from, until),
      std::invalid_argument);
}

TEST(SignedText, IsWhatItsCaSigned) {
  const Authority authority;
  const std::string sut = sign_text("<dds/>\n", authority.certificate, authority.key);
  const auto text = verified_text(sut, authority.certificate);
  ASSERT_TRUE(text) << text.error();
  EXPECT_THAT(*text, HasSubstr("<dds/>"));
}

TEST(SignedText, IsRefusedIfChangedOrSignedByAnother) {
  const Authority authority;
  const Authority another;
  std::string sut = sign_text("<allow/>\n", authority.certificate, authority.key);
  EXPECT_THAT(verified_text(sut, another.certificate).error(), HasSubstr("is not signed by"));
  sut.replace(sut.find("<allow/>"), 8, "<admit/>");
  EXPECT_THAT(verified_text(sut, authority.certificate).error(), HasSubstr("is not signed by"));
  EXPECT_THAT(verified_text("nothing", authority.certificate).error(),
              HasSubstr("not a signed document"));
}

// Signed so that a renewed certificate of the CA verifies it too.
TEST(SignedText, VerifiesWithARenewedCertificateOfItsCa) {
  const Authority authority;
  const auto lasting = [&](Time end) {
    return self_signed(authority.key, {.organisation = "plant",
                                       .common_name = "authority",
                                       .from = from,
                                       .until = end,
                                       .serial = authority.certificate.serial()});
  };
  const Certificate renewed = lasting(until + 24h);
  EXPECT_EQ(renewed.serial(), authority.certificate.serial());
  const Certificate signer =
      issue(authority.key,
            {.organisation = "plant", .common_name = "signer", .from = from, .until = until},
            authority.certificate, authority.key);
  const std::string sut = sign_text("<dds/>\n", signer, authority.key);
  EXPECT_TRUE(verified_text(sut, authority.certificate));
  EXPECT_TRUE(verified_text(sut, renewed));
  // A document with the root itself verifies only with that same root: Cyclone accepts no other.
  const std::string by_root = sign_text("<dds/>\n", authority.certificate, authority.key);
  EXPECT_TRUE(verified_text(by_root, authority.certificate));
  EXPECT_THAT(verified_text(by_root, renewed).error(), HasSubstr("has not issued"));
}

// The certificate of a participant cannot sign its permissions.
TEST(SignedText, OfAParticipantIsNotThatOfItsCa) {
  const Authority authority;
  const Key key = Key::generate();
  const Certificate member =
      issue(key, {.organisation = "plant", .common_name = "x", .from = from, .until = until},
            authority.certificate, authority.key);
  const std::string sut = sign_text("<allow/>\n", member, key);
  EXPECT_FALSE(verified_text(sut, authority.certificate));
}

}  // namespace
}  // namespace millrace::base::openssl
