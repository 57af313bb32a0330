#include "tools/trust/pki_folder.hpp"

#include <array>
#include <cstdlib>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/openssl/certificate.hpp"
#include "tests/unit/tools/trust/pki_folder_fixture.hpp"

namespace millrace::tools::trust {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

TEST_F(PkiFolderTest, IssuesAFolderThatAProcessAccepts) {
  create();
  PkiFolder sut = open();
  const auto entry = sut.issue(service(), {.host = "h1"}, {}, now);
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_EQ(entry->until, now + std::chrono::days(825));
  for (const Protection protection : {Protection::sign, Protection::encrypt}) {
    const auto read = read_folder(folder / "root", protection, now + 1h);
    ASSERT_TRUE(read) << read.error();
    EXPECT_EQ(read->name, "root");
    EXPECT_EQ(read->until, entry->until);
  }
}

TEST_F(PkiFolderTest, KeepsSecretsForItsOwner) {
  create();
  open().issue(service(), {}, {}, now).value();
  EXPECT_EQ(mode_of(folder), 0700U);
  EXPECT_EQ(mode_of(folder / "authorities"), 0700U);
  EXPECT_EQ(mode_of(folder / "authorities/identity.key"), 0600U);
  EXPECT_EQ(mode_of(folder / "authorities/permissions.key"), 0600U);
  EXPECT_EQ(mode_of(folder / "root"), 0700U);
  EXPECT_EQ(mode_of(folder / "root/key.pem"), 0600U);
}

TEST_F(PkiFolderTest, GivesAParticipantNoKeysOfTheCas) {
  create();
  open().issue(service(), {}, {}, now).value();
  const std::string keys[] = {content_of(folder / "authorities/identity.key"),
                              content_of(folder / "authorities/permissions.key")};
  for (const fs::directory_entry& file : fs::directory_iterator(folder / "root")) {
    for (const std::string& key : keys) {
      EXPECT_EQ(content_of(file.path()).find(key.substr(40, 60)), std::string::npos) << file.path();
    }
  }
}

TEST_F(PkiFolderTest, IsNeverOverwritten) {
  create();
  const std::string before = content_of(folder / "authorities/identity.key");
  EXPECT_THAT(PkiFolder::create(folder, "plant", "millrace", 3650, {}, now).error(),
              HasSubstr("never overwritten"));
  EXPECT_EQ(content_of(folder / "authorities/identity.key"), before);
}

TEST_F(PkiFolderTest, IssuesANameOnce) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  const std::string before = content_of(folder / "root/certificate.pem");
  EXPECT_THAT(sut.issue(service(), {}, {}, now).error(), HasSubstr("trust renew"));
  EXPECT_EQ(content_of(folder / "root/certificate.pem"), before);
  EXPECT_THAT(sut.entries(), SizeIs(1));
}

TEST_F(PkiFolderTest, RemembersItsParticipants) {
  create();
  open().issue(service(), {.host = "h1"}, {}, now).value();
  const auto entry = open().entry("root");
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_EQ(entry->participant.uuids, std::vector{uuid});
  EXPECT_EQ(entry->participant.roles, std::set{Role::service});
  EXPECT_EQ(entry->host, "h1");
  EXPECT_FALSE(entry->revoked);
}

TEST_F(PkiFolderTest, RefusesNamesThatLeadOutOfItsFolder) {
  create();
  PkiFolder sut = open();
  for (const char* name :
       {"../x", "authorities", "register.textproto", "revoked.pem", ".lock", ""}) {
    EXPECT_FALSE(sut.issue(service(name), {}, {}, now)) << name;
  }
  EXPECT_THAT(sut.entries(), SizeIs(0));
}

TEST_F(PkiFolderTest, RenewsWithNewCredentialsBesideWhichTheOldStayValid) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {.days = 10}, {}, now).value();
  fs::copy(folder / "root", folder / "kept", fs::copy_options::recursive);
  const auto renewed = sut.renew("root", 100, {}, now + 24h);
  ASSERT_TRUE(renewed) << renewed.error();
  EXPECT_EQ(renewed->until, now + 24h + std::chrono::days(100));
  EXPECT_NE(content_of(folder / "root/key.pem"), content_of(folder / "kept/key.pem"));
  EXPECT_EQ(why_refused("kept", now + 48h), "not refused");
  EXPECT_EQ(why_refused("root", now + 48h), "not refused");
}

// Another UUID and another machine for the same name.
TEST_F(PkiFolderTest, IssuesAgainWithNewGrantsOfAParticipant) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {.host = "h1"}, {}, now).value();
  const Participant gateway{.name = "root", .roles = {Role::gateway}, .machines = {"press_1"}};
  const auto entry = sut.reissue(gateway, {}, {}, now);
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_EQ(entry->participant.machines, std::vector<std::string>{"press_1"});
  EXPECT_THAT(entry->participant.uuids, SizeIs(0));
  EXPECT_EQ(entry->host, "h1");
  EXPECT_EQ(why_refused(), "not refused");
  EXPECT_THAT(read_folder(folder / "root", Protection::sign, now + 1h)->identity_partitions,
              testing::Contains("millrace/@machine/press_1"));
  EXPECT_THAT(sut.entries(), SizeIs(1));
  // And it stays unchanged if the command is wrong.
  EXPECT_FALSE(sut.reissue({.name = "root", .roles = {Role::gateway}}, {}, {}, now));
  EXPECT_FALSE(sut.reissue(service(), {.days = 0}, {}, now));
  EXPECT_EQ(sut.entry("root")->participant.machines, std::vector<std::string>{"press_1"});
  // Both certificates are revoked.
  ASSERT_TRUE(sut.revoke("root", {}, now));
  EXPECT_THAT(sut.reissue(gateway, {}, {}, now).error(), HasSubstr("no process accepts that name"));
  EXPECT_FALSE(sut.reissue(service("unknown"), {}, {}, now));
}

TEST_F(PkiFolderTest, RevokesEveryCertificateOfAParticipant) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  sut.issue(service("another"), {}, {}, now).value();
  fs::copy(folder / "root", folder / "kept", fs::copy_options::recursive);
  sut.renew("root", 100, {}, now).value();
  ASSERT_TRUE(sut.revoke("root", {}, now));
  fs::copy(folder / "root/revoked.pem", folder / "kept/revoked.pem",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused("root"), HasSubstr("was revoked"));
  EXPECT_THAT(why_refused("kept"), HasSubstr("was revoked"));
  EXPECT_EQ(why_refused("another"), "not refused");
  EXPECT_TRUE(sut.entry("root")->revoked);
  // A revocation has the participant's name.
  EXPECT_EQ(fabric::trust::read_revoked(folder / "another"), std::set<std::string>{"root"});
  EXPECT_THAT(sut.renew("root", 100, {}, now).error(), HasSubstr("no process accepts that name"));
}

TEST_F(PkiFolderTest, GivesNewParticipantsTheCrl) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  ASSERT_TRUE(sut.revoke("root", {}, now));
  sut.issue(service("another"), {}, {}, now).value();
  fs::copy(folder / "another/revoked.pem", folder / "root/revoked.pem",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused("root"), HasSubstr("was revoked"));
}

// A user who follows "take it there" with `mv` has no folder left.
TEST_F(PkiFolderTest, RevokesAParticipantWithoutAFolderAndUpdatesAllOthers) {
  create();
  PkiFolder sut = open();
  for (const char* name : {"a", "root", "z"}) {
    sut.issue(service(name), {}, {}, now).value();
  }
  fs::rename(folder / "a", temporary.path() / "a");
  fs::rename(folder / "root", temporary.path() / "root");
  const auto done = sut.revoke("root", {}, now + 1s);
  ASSERT_TRUE(done) << done.error();
  EXPECT_EQ(fabric::trust::read_revoked(folder / "z"), std::set<std::string>{"root"});
  EXPECT_EQ(content_of(folder / "revoked.pem"), content_of(folder / "z/revoked.pem"));
  EXPECT_FALSE(fs::exists(folder / "a"));
  EXPECT_THAT(sut.archive_of("a").error(), HasSubstr("trust renew"));
}

TEST_F(PkiFolderTest, HasOneCrlForAllWhateverWasIssuedLast) {
  create();
  PkiFolder sut = open();
  sut.issue(service("a"), {}, {}, now).value();
  ASSERT_TRUE(sut.revoke("a", {}, now + 1s));
  sut.issue(service(), {}, {}, now + 2s).value();
  for (const char* of : {"a", "root"}) {
    EXPECT_EQ(content_of(folder / of / "revoked.pem"), content_of(folder / "revoked.pem")) << of;
  }
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(PkiFolderTest, SignsNothingThatOutlivesItsCas) {
  ASSERT_TRUE(PkiFolder::create(folder, "plant", "millrace", 30, {}, now));
  PkiFolder sut = open();
  EXPECT_EQ(sut.issue(service(), {.days = 825}, {}, now)->until, now + std::chrono::days(30));
  EXPECT_THAT(sut.renew("root", 825, {}, now + std::chrono::days(31)).error(),
              HasSubstr("have expired"));
}

TEST_F(PkiFolderTest, RenewsItsCasWithTheirKeys) {
  ASSERT_TRUE(PkiFolder::create(folder, "plant", "millrace", 30, {}, now));
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  sut.issue(service("gone"), {}, {}, now).value();
  ASSERT_TRUE(sut.revoke("gone", {}, now));
  EXPECT_EQ(sut.authorities_until(), now + std::chrono::days(30));
  const std::string key = content_of(folder / "authorities/permissions.key");
  const std::string gone = content_of(folder / "gone/certificate.pem");

  const Time later = now + std::chrono::days(20);
  const auto done = sut.renew_authorities(3650, 825, {}, later);
  ASSERT_TRUE(done) << done.error();
  EXPECT_EQ(sut.authorities_until(), later + std::chrono::days(3650));
  EXPECT_EQ(content_of(folder / "authorities/permissions.key"), key);
  EXPECT_EQ(sut.entry("root")->until, later + std::chrono::days(825));
  EXPECT_EQ(why_refused("root", later + std::chrono::days(824)), "not refused");
  EXPECT_EQ(content_of(folder / "gone/certificate.pem"), gone);
  EXPECT_TRUE(sut.entry("gone")->revoked);
}

// The others check with their own CAs and revocations the certificate and documents of a
// participant.
TEST_F(PkiFolderTest, KeepsOldAndNewCredentialsValidForEachOtherWhenItsCasAreRenewed) {
  ASSERT_TRUE(PkiFolder::create(folder, "plant", "millrace", 30, {}, now));
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  fs::copy(folder / "root", folder / "old", fs::copy_options::recursive);
  ASSERT_TRUE(sut.renew_authorities(3650, 825, {}, now + std::chrono::days(20)));
  fs::copy(folder / "root", folder / "new", fs::copy_options::recursive);
  for (const char* ca_file : {"identity_authority.pem", "permissions_authority.pem"}) {
    EXPECT_NE(content_of(folder / "old" / ca_file), content_of(folder / "new" / ca_file));
    fs::rename(folder / "old" / ca_file, folder / "kept");
    fs::rename(folder / "new" / ca_file, folder / "old" / ca_file);
    fs::rename(folder / "kept", folder / "new" / ca_file);
  }
  // Lists signed by either CA count; a host accepts none that is older than its certificate.
  EXPECT_TRUE(fabric::trust::read_revoked(folder / "old"));
  EXPECT_TRUE(fabric::trust::read_revoked(folder / "new"));
  fs::copy(folder / "new/revoked.pem", folder / "old/revoked.pem",
           fs::copy_options::overwrite_existing);
  const Time between = now + std::chrono::days(25);
  EXPECT_EQ(why_refused("old", between), "not refused");
  EXPECT_EQ(why_refused("new", between), "not refused");
  // And only as long as both are valid.
  EXPECT_THAT(why_refused("old", now + std::chrono::days(31)), HasSubstr("expired on"));
  EXPECT_THAT(why_refused("new", now + std::chrono::days(31)),
              AllOf(HasSubstr("identity_authority.pem"), HasSubstr("renew-authorities")));
}

TEST_F(PkiFolderTest, RenewsExpiredCas) {
  ASSERT_TRUE(PkiFolder::create(folder, "plant", "millrace", 30, {}, now));
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  const Time late = now + std::chrono::days(40);
  EXPECT_THAT(sut.renew("root", 825, {}, late).error(), HasSubstr("renew-authorities"));
  ASSERT_TRUE(sut.renew_authorities(3650, 825, {}, late));
  EXPECT_EQ(why_refused("root", late + 1h), "not refused");
}

TEST_F(PkiFolderTest, RenewsNoCasWithoutTheirPassphraseOrForNoTime) {
  create("open sesame");
  PkiFolder sut = open();
  const std::string before = content_of(folder / "authorities/identity.pem");
  EXPECT_THAT(sut.renew_authorities(3650, 825, {}, now).error(), HasSubstr("no passphrase"));
  EXPECT_THAT(sut.renew_authorities(0, 825, "open sesame", now).error(), HasSubstr("expected 1"));
  EXPECT_THAT(sut.renew_authorities(3650, 0, "open sesame", now).error(), HasSubstr("expected 1"));
  EXPECT_EQ(content_of(folder / "authorities/identity.pem"), before);
}

TEST_F(PkiFolderTest, OpensEncryptedCasWithTheirPassphrase) {
  create("open sesame");
  PkiFolder sut = open();
  EXPECT_THAT(sut.issue(service(), {}, {}, now).error(), HasSubstr("no passphrase is given"));
  EXPECT_THAT(sut.issue(service(), {}, "wrong", now).error(), HasSubstr("does not open"));
  EXPECT_TRUE(sut.issue(service(), {}, "open sesame", now));
}

TEST_F(PkiFolderTest, IsWrittenByOneCommandAtATime) {
  create();
  const PkiFolder sut = open();
  EXPECT_THAT(PkiFolder::open(folder).error(), HasSubstr("another `millrace trust`"));
}

TEST_F(PkiFolderTest, CanBeReadWhileItIsWritten) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  const auto looked = PkiFolder::look(folder);
  ASSERT_TRUE(looked) << looked.error();
  EXPECT_THAT(looked->entries(), SizeIs(1));
}

TEST_F(PkiFolderTest, LeavesNothingBehindIfItCannotBeMade) {
  const std::string names[] = {std::string(65, 'p'), "", "a\nb", "\xff\xfe"};
  for (const std::string& name : names) {
    EXPECT_THAT(PkiFolder::create(folder, name, "millrace", 3650, {}, now).error(),
                AllOf(HasSubstr("is not a PKI name"), testing::Not(HasSubstr("\n"))))
        << name;
    EXPECT_FALSE(fs::exists(folder));
  }
  EXPECT_TRUE(PkiFolder::create(folder,
                                "Werk S\xc3\xbc"
                                "d, \"Halle\" <1>",
                                "millrace", 3650, {}, now));
  open().issue(service(), {}, {}, now).value();
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(PkiFolderTest, IsAsItWasAfterAFullDisk) {
  // Room for a key, but not for a certificate; then for certificates, but not for a document.
  for (const rlim_t room : {0UL, 300UL, 620UL}) {
    const FullDisk full(room);
    EXPECT_THAT(PkiFolder::create(folder, "plant", "millrace", 3650, {}, now).error(),
                HasSubstr("cannot write"));
    EXPECT_FALSE(fs::exists(folder)) << room;
  }
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  const std::string before = content_of(folder / "root/certificate.pem");
  for (const rlim_t room : {0UL, 300UL, 1000UL}) {
    const FullDisk full(room);
    EXPECT_FALSE(sut.issue(service("another"), {}, {}, now + 1s)) << room;
    EXPECT_FALSE(sut.renew("root", 100, {}, now + 1s)) << room;
    EXPECT_FALSE(sut.reissue({.name = "root", .roles = {Role::observer}}, {}, {}, now + 1s))
        << room;
  }
  {
    const FullDisk full(100);
    EXPECT_FALSE(sut.revoke("root", {}, now));
  }
  EXPECT_EQ(content_of(folder / "root/certificate.pem"), before);
  EXPECT_EQ(why_refused(), "not refused");
  EXPECT_FALSE(fs::exists(folder / "another"));
  EXPECT_FALSE(fs::exists(folder / ".another.part"));
  const PkiFolder after = PkiFolder::look(folder).value();
  EXPECT_THAT(after.entries(), SizeIs(1));
  EXPECT_EQ(after.entry("root")->participant.uuids, std::vector{uuid});
  EXPECT_FALSE(after.entry("root")->revoked);
  // With room it succeeds.
  EXPECT_TRUE(sut.issue(service("another"), {}, {}, now + 1s));
  EXPECT_TRUE(sut.revoke("root", {}, now));
}

// What an interrupted command leaves: `init` without its register, `issue` with an incomplete
// folder.
TEST_F(PkiFolderTest, ExplainsAnInterruptedInit) {
  create();
  fs::remove(folder / "register.textproto");
  EXPECT_THAT(PkiFolder::create(folder, "plant", "millrace", 3650, {}, now).error(),
              AllOf(HasSubstr("did not finish here"), HasSubstr("remove")));
}

TEST_F(PkiFolderTest, RemovesTheKeysOfAnInterruptedIssue) {
  create();
  open().issue(service(), {}, {}, now).value();
  fs::rename(folder / "root", folder / ".root.part");
  PkiFolder sut = open();
  EXPECT_FALSE(fs::exists(folder / ".root.part"));
  ASSERT_TRUE(sut.renew("root", 100, {}, now));
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(PkiFolderTest, SignsWithNoKeyThatOthersCanRead) {
  create();
  PkiFolder sut = open();
  for (const char* key : {"authorities/identity.key", "authorities/permissions.key"}) {
    ::chmod((folder / key).c_str(), 0640);
    EXPECT_THAT(sut.issue(service(), {}, {}, now).error(),
                AllOf(HasSubstr(key), HasSubstr("chmod go=")));
    ::chmod((folder / key).c_str(), 0600);
  }
  EXPECT_TRUE(sut.issue(service(), {}, {}, now));
}

TEST_F(PkiFolderTest, IssuesAFolderThatIsRefusedOnceOthersMayWriteIt) {
  create();
  open().issue(service(), {}, {}, now).value();
  const fs::path root = folder / "root";
  const std::vector<std::pair<fs::path, unsigned>> wrong{
      {root, 0777U},
      {root / "revoked.pem", 0666U},
      {root / "identity_authority.pem", 0666U},
      {root / "permissions_authority.pem", 0646U},
      {root / "certificate.pem", 0666U},
      {root / "permissions.p7s", 0666U},
      {root / "governance_sign.p7s", 0666U},
      {root / "key.pem", 0644U},
      {root / "key.pem", 0660U},
  };
  for (const auto& [path, mode] : wrong) {
    const fs::perms before = fs::status(path).permissions();
    fs::permissions(path, fs::perms(mode));
    EXPECT_THAT(why_refused(), AllOf(HasSubstr(path.string()), HasSubstr("chmod"))) << path;
    fs::permissions(path, before);
  }
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(PkiFolderTest, IssuesAFolderInWhichAPipeIsNoFile) {
  create();
  open().issue(service(), {}, {}, now).value();
  for (const auto& entry : fs::directory_iterator(folder / "root")) {
    if (entry.path().filename() == "governance_encrypt.p7s") {
      continue;
    }
    const fs::path kept = temporary.path() / "kept";
    fs::rename(entry.path(), kept);
    ASSERT_EQ(::mkfifo(entry.path().c_str(), 0600), 0);
    EXPECT_THAT(why_refused(), HasSubstr("is not a regular file")) << entry.path();
    fs::remove(entry.path());
    fs::rename(kept, entry.path());
  }
}

// A regression: `millrace trust issue` waited for a writer of the pipe.
TEST_F(PkiFolderTest, ReadsNoCaFromAPipeOrFromAFileThatOthersMayWrite) {
  create();
  const fs::path file = folder / "authorities/identity.pem";
  fs::permissions(file, fs::perms(0666));
  EXPECT_THAT(open().issue(service(), {}, {}, now).error(),
              HasSubstr("all users of this host can write it"));
  fs::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_THAT(open().issue(service(), {}, {}, now).error(), HasSubstr("is not a regular file"));
}

TEST_F(PkiFolderTest, RefusesAFolderThatIsNoPki) {
  EXPECT_THAT(PkiFolder::open(temporary.path()).error(), HasSubstr("millrace trust init"));
}

/// The first bytes of the input from which DDS Security computes a participant's GUID.
std::string hash_of_name(const fs::path& certificate) {
  const auto read = base::openssl::Certificate::read(content_of(certificate)).value();
  std::array<unsigned char, 32> hash{};
  unsigned size = 0;
  EXPECT_EQ(X509_NAME_digest(X509_get_subject_name(read.get()), EVP_sha256(), hash.data(), &size),
            1);
  return fmt::format("{:02x}{:02x}{:02x}", hash[0], hash[1], hash[2]);
}

TEST_F(PkiFolderTest, NamesAForeignParticipantSoThatTheOthersBeginTheHandshake) {
  create();
  PkiFolder sut = open();
  const auto entry = sut.issue(service("fastdds"), {.foreign = true}, {}, now);
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_TRUE(entry->foreign);
  EXPECT_THAT(hash_of_name(folder / "fastdds/certificate.pem"), StartsWith("fffff"));
  const auto read = read_folder(folder / "fastdds", Protection::sign, now + 1h);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->name, "fastdds");
  // Also after a renewal.
  ASSERT_TRUE(sut.renew("fastdds", 100, {}, now));
  EXPECT_THAT(hash_of_name(folder / "fastdds/certificate.pem"), StartsWith("fffff"));
}

TEST_F(PkiFolderTest, PacksTheFolderOfAParticipant) {
  create();
  PkiFolder sut = open();
  sut.issue(service(), {}, {}, now).value();
  const auto archive = sut.archive_of("root");
  ASSERT_TRUE(archive) << archive.error();
  const fs::path file = temporary.path() / "root.tar";
  std::ofstream(file, std::ios::binary) << *archive;
  const fs::path there = temporary.path() / "host";
  fs::create_directory(there);
  ASSERT_EQ(std::system(("tar -x -f " + file.string() + " -C " + there.string()).c_str()), 0);
  EXPECT_EQ(mode_of(there / "root/key.pem"), 0600U);
  EXPECT_EQ(content_of(there / "root/permissions.p7s"),
            content_of(folder / "root/permissions.p7s"));
  EXPECT_TRUE(read_folder(there / "root", Protection::sign, now + 1h));
  EXPECT_FALSE(sut.archive_of("unknown"));
}

}  // namespace
}  // namespace millrace::tools::trust
