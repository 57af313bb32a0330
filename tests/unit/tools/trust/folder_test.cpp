// Errors in a host's folder that are reported before Cyclone would fail without a helpful message.
#include <gmock/gmock.h>

#include "base/openssl/signed_text.hpp"
#include "fabric/trust/permissions.hpp"
#include "tests/unit/tools/trust/pki_folder_fixture.hpp"

namespace millrace::tools::trust {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class FolderTest : public PkiFolderTest {
 protected:
  void SetUp() override {
    create();
    open().issue(service(), {.days = 10}, {}, now).value();
    ASSERT_TRUE(PkiFolder::create(temporary.path() / "other", "plant", "millrace", 3650, {}, now));
    PkiFolder::open(temporary.path() / "other")->issue(service(), {}, {}, now).value();
  }
  void copy_from_other(std::string_view file) const {
    fs::copy(temporary.path() / "other/root" / file, folder / "root" / file,
             fs::copy_options::overwrite_existing);
  }
};

TEST_F(FolderTest, NamesAFileThatIsMissing) {
  for (const char* file :
       {"certificate.pem", "key.pem", "identity_authority.pem", "permissions_authority.pem",
        "revoked.pem", "permissions.p7s", "governance_sign.p7s"}) {
    fs::rename(folder / "root" / file, folder / "away");
    EXPECT_THAT(why_refused(), HasSubstr(file)) << file;
    fs::rename(folder / "away", folder / "root" / file);
  }
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesAKeyThatAnyUserCanRead) {
  ::chmod((folder / "root/key.pem").c_str(), 0604);
  EXPECT_THAT(why_refused(), HasSubstr("all users of this host can read it"));
  // Readable for a group: as a package or systemd gives it to a service.
  ::chmod((folder / "root/key.pem").c_str(), 0640);
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesWhatIsExpiredOrNotYetValid) {
  EXPECT_THAT(why_refused("root", now + std::chrono::days(10)), HasSubstr("expired on"));
  EXPECT_THAT(why_refused("root", now - 1h), HasSubstr("not valid before"));
}

TEST_F(FolderTest, RefusesFilesOfAnotherPki) {
  for (const char* file :
       {"key.pem", "certificate.pem", "identity_authority.pem", "permissions_authority.pem",
        "revoked.pem", "permissions.p7s", "governance_sign.p7s"}) {
    fs::copy(folder / "root" / file, folder / "kept");
    copy_from_other(file);
    EXPECT_NE(why_refused(), "not refused") << file;
    fs::remove(folder / "root" / file);
    fs::rename(folder / "kept", folder / "root" / file);
  }
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesPermissionsOfAnotherParticipantOrAnotherTime) {
  PkiFolder pki = open();
  pki.issue(service("another"), {}, {}, now).value();
  fs::copy(folder / "root", folder / "kept", fs::copy_options::recursive);
  fs::copy(folder / "another/permissions.p7s", folder / "root/permissions.p7s",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused(),
              AllOf(HasSubstr("permissions.p7s"), HasSubstr("is made for CN=another")));
  pki.renew("root", 10, {}, now + 1s).value();
  fs::copy(folder / "kept/permissions.p7s", folder / "root/permissions.p7s",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused(), AllOf(HasSubstr("permissions.p7s"), HasSubstr("is valid from")));
}

TEST_F(FolderTest, RefusesTheGovernanceOfAnotherProtection) {
  fs::copy(folder / "root/governance_encrypt.p7s", folder / "root/governance_sign.p7s",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused(),
              AllOf(HasSubstr("governance_sign.p7s"), HasSubstr("the governance of ENCRYPT")));
}

/// Documents that the permissions CA itself signed: by an earlier version, or by mistake.
class SignedByTheCa : public FolderTest {
 protected:
  void sign(std::string_view file, const std::string& document) const {
    const auto authority =
        base::openssl::Certificate::read(content_of(folder / "authorities/permissions.pem"))
            .value();
    const auto key =
        base::openssl::Key::read(content_of(folder / "authorities/permissions.key")).value();
    std::ofstream(folder / "root" / file, std::ios::binary)
        << base::openssl::sign_text(document, authority, key);
  }
};

TEST_F(SignedByTheCa, ARelaxedGovernanceIsRefused) {
  std::string relaxed = fabric::trust::governance_document(Protection::sign);
  sign("governance_sign.p7s", relaxed);
  EXPECT_EQ(why_refused(), "not refused");
  relaxed.replace(relaxed.find("false</allow_unauth"), 5, "true");
  sign("governance_sign.p7s", relaxed);
  EXPECT_THAT(why_refused(),
              AllOf(HasSubstr("governance_sign.p7s"), HasSubstr("millrace trust renew")));
}

// From a version before identities.
TEST_F(SignedByTheCa, AFolderOfAnEarlierVersionIsNamedAndRenewed) {
  const auto certificate =
      base::openssl::Certificate::read(content_of(folder / "root/certificate.pem")).value();
  auto grants = fabric::trust::grants_of(service(), "millrace");
  std::erase_if(grants, [](const fabric::trust::Grant& grant) {
    return grant.topic == "millrace/v5/identity";
  });
  sign("permissions.p7s",
       fabric::trust::permissions_document(grants, certificate.subject(), certificate.from(),
                                           certificate.until()));
  EXPECT_THAT(why_refused(), AllOf(HasSubstr("permissions.p7s"),
                                   HasSubstr("was made by an earlier version of millrace"),
                                   HasSubstr("millrace trust renew")));
  open().renew("root", 10, {}, now).value();
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesACrlThatIsOlderThanItsCertificate) {
  fs::copy(folder / "root/revoked.pem", folder / "older");
  PkiFolder pki = open();
  pki.renew("root", 10, {}, now + 1s).value();
  EXPECT_EQ(why_refused(), "not refused");
  fs::copy(folder / "older", folder / "root/revoked.pem", fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused(),
              AllOf(HasSubstr("revoked.pem"), HasSubstr("an older CRL was copied over it")));
}

TEST_F(FolderTest, ExplainsThatAPkiFolderIsNotForAHost) {
  EXPECT_THAT(why_refused(""), HasSubstr("is a PKI folder with the private keys"));
}

TEST_F(FolderTest, RefusesAMissingFolder) {
  EXPECT_THAT(why_refused("missing"), HasSubstr("is not a folder"));
}

}  // namespace
}  // namespace millrace::tools::trust
