#include "tools/trust/plant.hpp"

#include <array>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/openssl/certificate.hpp"
#include "fabric/trust/folder.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tools::trust {
namespace {

using namespace std::chrono_literals;
using fabric::trust::Member;
using fabric::trust::Protection;
using fabric::trust::read_folder;
using fabric::trust::Role;
using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

constexpr Time now{1'800'000'000s};
const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

mode_t mode_of(const fs::path& file) {
  struct stat status {};
  EXPECT_EQ(::stat(file.c_str(), &status), 0) << file;
  return status.st_mode & 07777U;
}

class PlantTest : public testing::Test {
 protected:
  [[nodiscard]] Plant open() const {
    auto plant = Plant::open(folder);
    if (!plant) {
      throw std::runtime_error(plant.error());
    }
    return std::move(*plant);
  }
  void create(std::string_view passphrase = {}) const {
    const auto made = Plant::create(folder, "plant", "millrace", 3650, passphrase, now);
    ASSERT_TRUE(made) << made.error();
  }
  static Member service(const std::string& name = "root") {
    return {.name = name, .roles = {Role::service}, .uuids = {uuid}};
  }
  [[nodiscard]] std::string why_refused(std::string_view name = "root",
                                        Time when = now + 1h) const {
    const auto read = read_folder(folder / name, Protection::sign, when);
    return read ? "not refused" : read.error();
  }

  tests::TemporaryFolder temporary;
  fs::path folder = temporary.path() / "plant";
};

TEST_F(PlantTest, IssuesAFolderThatAProgramTakes) {
  create();
  Plant sut = open();
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

TEST_F(PlantTest, KeepsSecretsForItsOwner) {
  create();
  open().issue(service(), {}, {}, now).value();
  EXPECT_EQ(mode_of(folder), 0700U);
  EXPECT_EQ(mode_of(folder / "authorities"), 0700U);
  EXPECT_EQ(mode_of(folder / "authorities/identity.key"), 0600U);
  EXPECT_EQ(mode_of(folder / "authorities/permissions.key"), 0600U);
  EXPECT_EQ(mode_of(folder / "root"), 0700U);
  EXPECT_EQ(mode_of(folder / "root/key.pem"), 0600U);
}

TEST_F(PlantTest, GivesAMemberNothingOfTheAuthorities) {
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

TEST_F(PlantTest, IsNeverOverwritten) {
  create();
  const std::string before = content_of(folder / "authorities/identity.key");
  EXPECT_THAT(Plant::create(folder, "plant", "millrace", 3650, {}, now).error(),
              HasSubstr("never overwritten"));
  EXPECT_EQ(content_of(folder / "authorities/identity.key"), before);
}

TEST_F(PlantTest, IssuesANameOnce) {
  create();
  Plant sut = open();
  sut.issue(service(), {}, {}, now).value();
  const std::string before = content_of(folder / "root/certificate.pem");
  EXPECT_THAT(sut.issue(service(), {}, {}, now).error(), HasSubstr("trust renew"));
  EXPECT_EQ(content_of(folder / "root/certificate.pem"), before);
  EXPECT_THAT(sut.entries(), SizeIs(1));
}

TEST_F(PlantTest, RemembersWhomItBelieved) {
  create();
  open().issue(service(), {.host = "h1"}, {}, now).value();
  const auto entry = open().entry("root");
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_EQ(entry->member.uuids, std::vector{uuid});
  EXPECT_EQ(entry->member.roles, std::set{Role::service});
  EXPECT_EQ(entry->host, "h1");
  EXPECT_FALSE(entry->revoked);
}

TEST_F(PlantTest, RefusesNamesThatWouldLeadElsewhere) {
  create();
  Plant sut = open();
  for (const char* name : {"../x", "authorities", "register.textproto", ".lock", ""}) {
    EXPECT_FALSE(sut.issue(service(name), {}, {}, now)) << name;
  }
  EXPECT_THAT(sut.entries(), SizeIs(0));
}

TEST_F(PlantTest, RenewsWithNewMaterialBesideWhichTheOldStaysValid) {
  create();
  Plant sut = open();
  sut.issue(service(), {.days = 10}, {}, now).value();
  fs::copy(folder / "root", folder / "kept", fs::copy_options::recursive);
  const auto renewed = sut.renew("root", 100, {}, now + 24h);
  ASSERT_TRUE(renewed) << renewed.error();
  EXPECT_EQ(renewed->until, now + 24h + std::chrono::days(100));
  EXPECT_NE(content_of(folder / "root/key.pem"), content_of(folder / "kept/key.pem"));
  EXPECT_EQ(why_refused("kept", now + 48h), "not refused");
  EXPECT_EQ(why_refused("root", now + 48h), "not refused");
}

TEST_F(PlantTest, TakesBackEverythingThatAMemberEverGot) {
  create();
  Plant sut = open();
  sut.issue(service(), {}, {}, now).value();
  sut.issue(service("another"), {}, {}, now).value();
  fs::copy(folder / "root", folder / "kept", fs::copy_options::recursive);
  sut.renew("root", 100, {}, now).value();
  ASSERT_TRUE(sut.revoke("root", {}, now));
  fs::copy(folder / "root/revoked.pem", folder / "kept/revoked.pem",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused("root"), HasSubstr("has been revoked"));
  EXPECT_THAT(why_refused("kept"), HasSubstr("has been revoked"));
  EXPECT_EQ(why_refused("another"), "not refused");
  EXPECT_TRUE(sut.entry("root")->revoked);
  // Who is on is known by his name.
  EXPECT_EQ(fabric::trust::read_revoked(folder / "another"), std::set<std::string>{"root"});
  EXPECT_THAT(sut.renew("root", 100, {}, now).error(), HasSubstr("nobody believes that name"));
}

TEST_F(PlantTest, TellsNewMembersWhoWasTakenBack) {
  create();
  Plant sut = open();
  sut.issue(service(), {}, {}, now).value();
  ASSERT_TRUE(sut.revoke("root", {}, now));
  sut.issue(service("another"), {}, {}, now).value();
  fs::copy(folder / "another/revoked.pem", folder / "root/revoked.pem",
           fs::copy_options::overwrite_existing);
  EXPECT_THAT(why_refused("root"), HasSubstr("has been revoked"));
}

TEST_F(PlantTest, SignsNothingThatOutlivesItsAuthorities) {
  ASSERT_TRUE(Plant::create(folder, "plant", "millrace", 30, {}, now));
  Plant sut = open();
  EXPECT_EQ(sut.issue(service(), {.days = 825}, {}, now)->until, now + std::chrono::days(30));
  EXPECT_THAT(sut.renew("root", 825, {}, now + std::chrono::days(31)).error(),
              HasSubstr("no longer valid"));
}

TEST_F(PlantTest, RenewsItsAuthoritiesWithTheKeysThatTheyHave) {
  ASSERT_TRUE(Plant::create(folder, "plant", "millrace", 30, {}, now));
  Plant sut = open();
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

// What the others look at is their own authorities and revocations, and somebody's certificate and
// documents.
TEST_F(PlantTest, HasOldAndNewMaterialCountForEachOtherWhenItsAuthoritiesAreRenewed) {
  ASSERT_TRUE(Plant::create(folder, "plant", "millrace", 30, {}, now));
  Plant sut = open();
  sut.issue(service(), {}, {}, now).value();
  fs::copy(folder / "root", folder / "old", fs::copy_options::recursive);
  ASSERT_TRUE(sut.renew_authorities(3650, 825, {}, now + std::chrono::days(20)));
  fs::copy(folder / "root", folder / "new", fs::copy_options::recursive);
  for (const char* theirs :
       {"identity_authority.pem", "permissions_authority.pem", "revoked.pem"}) {
    EXPECT_NE(content_of(folder / "old" / theirs), content_of(folder / "new" / theirs));
    fs::rename(folder / "old" / theirs, folder / "kept");
    fs::rename(folder / "new" / theirs, folder / "old" / theirs);
    fs::rename(folder / "kept", folder / "new" / theirs);
  }
  const Time between = now + std::chrono::days(25);
  EXPECT_EQ(why_refused("old", between), "not refused");
  EXPECT_EQ(why_refused("new", between), "not refused");
  // And no longer than each of them is valid.
  EXPECT_THAT(why_refused("old", now + std::chrono::days(31)), HasSubstr("expired on"));
  EXPECT_THAT(why_refused("new", now + std::chrono::days(31)),
              AllOf(HasSubstr("identity_authority.pem"), HasSubstr("renew-authorities")));
}

TEST_F(PlantTest, RenewsAuthoritiesThatAreOver) {
  ASSERT_TRUE(Plant::create(folder, "plant", "millrace", 30, {}, now));
  Plant sut = open();
  sut.issue(service(), {}, {}, now).value();
  const Time late = now + std::chrono::days(40);
  EXPECT_THAT(sut.renew("root", 825, {}, late).error(), HasSubstr("renew-authorities"));
  ASSERT_TRUE(sut.renew_authorities(3650, 825, {}, late));
  EXPECT_EQ(why_refused("root", late + 1h), "not refused");
}

TEST_F(PlantTest, RenewsNoAuthoritiesWithoutTheirPassphraseOrForNoTime) {
  create("open sesame");
  Plant sut = open();
  const std::string before = content_of(folder / "authorities/identity.pem");
  EXPECT_THAT(sut.renew_authorities(3650, 825, {}, now).error(), HasSubstr("no passphrase"));
  EXPECT_THAT(sut.renew_authorities(0, 825, "open sesame", now).error(), HasSubstr("expected 1"));
  EXPECT_THAT(sut.renew_authorities(3650, 0, "open sesame", now).error(), HasSubstr("expected 1"));
  EXPECT_EQ(content_of(folder / "authorities/identity.pem"), before);
}

TEST_F(PlantTest, OpensEncryptedAuthoritiesWithTheirPassphrase) {
  create("open sesame");
  Plant sut = open();
  EXPECT_THAT(sut.issue(service(), {}, {}, now).error(), HasSubstr("no passphrase is given"));
  EXPECT_THAT(sut.issue(service(), {}, "wrong", now).error(), HasSubstr("does not open"));
  EXPECT_TRUE(sut.issue(service(), {}, "open sesame", now));
}

TEST_F(PlantTest, IsWrittenByOneCommandAtATime) {
  create();
  const Plant sut = open();
  EXPECT_THAT(Plant::open(folder).error(), HasSubstr("another `millrace trust`"));
}

TEST_F(PlantTest, SaysWhatAFolderIsNot) {
  EXPECT_THAT(Plant::open(temporary.path()).error(), HasSubstr("millrace trust init"));
}

// What Cyclone would refuse without a word that helps.
class FolderTest : public PlantTest {
 protected:
  void SetUp() override {
    create();
    open().issue(service(), {.days = 10}, {}, now).value();
    ASSERT_TRUE(Plant::create(temporary.path() / "other", "plant", "millrace", 3650, {}, now));
    Plant::open(temporary.path() / "other")->issue(service(), {}, {}, now).value();
  }
  void take_from_the_other(std::string_view file) const {
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

TEST_F(FolderTest, RefusesAKeyThatEverybodyCanRead) {
  ::chmod((folder / "root/key.pem").c_str(), 0604);
  EXPECT_THAT(why_refused(), HasSubstr("everybody on this host can read it"));
  // Of a group: as a package or systemd hands it to a service.
  ::chmod((folder / "root/key.pem").c_str(), 0640);
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesWhatIsOverOrNotBegun) {
  EXPECT_THAT(why_refused("root", now + std::chrono::days(10)), HasSubstr("expired on"));
  EXPECT_THAT(why_refused("root", now - 1h), HasSubstr("not valid before"));
}

TEST_F(FolderTest, RefusesWhatIsOfAnotherPlant) {
  for (const char* file :
       {"key.pem", "certificate.pem", "identity_authority.pem", "permissions_authority.pem",
        "revoked.pem", "permissions.p7s", "governance_sign.p7s"}) {
    fs::copy(folder / "root" / file, folder / "kept");
    take_from_the_other(file);
    EXPECT_NE(why_refused(), "not refused") << file;
    fs::remove(folder / "root" / file);
    fs::rename(folder / "kept", folder / "root" / file);
  }
  EXPECT_EQ(why_refused(), "not refused");
}

TEST_F(FolderTest, RefusesAFolderThatIsNone) {
  EXPECT_THAT(why_refused("nobody"), HasSubstr("is no folder"));
}

/// The first bytes of what DDS Security makes a participant's GUID of.
std::string hash_of_name(const fs::path& certificate) {
  const auto read = base::openssl::Certificate::read(content_of(certificate)).value();
  std::array<unsigned char, 32> hash{};
  unsigned size = 0;
  EXPECT_EQ(X509_NAME_digest(X509_get_subject_name(read.get()), EVP_sha256(), hash.data(), &size),
            1);
  return fmt::format("{:02x}{:02x}{:02x}", hash[0], hash[1], hash[2]);
}

TEST_F(PlantTest, NamesAForeignMemberSoThatTheOthersBeginTheHandshake) {
  create();
  Plant sut = open();
  const auto entry = sut.issue(service("fastdds"), {.foreign = true}, {}, now);
  ASSERT_TRUE(entry) << entry.error();
  EXPECT_TRUE(entry->foreign);
  EXPECT_THAT(hash_of_name(folder / "fastdds/certificate.pem"), StartsWith("fffff"));
  const auto read = read_folder(folder / "fastdds", Protection::sign, now + 1h);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->name, "fastdds");
  // Also when it is renewed.
  ASSERT_TRUE(sut.renew("fastdds", 100, {}, now));
  EXPECT_THAT(hash_of_name(folder / "fastdds/certificate.pem"), StartsWith("fffff"));
}

TEST_F(PlantTest, PacksAMembersFolder) {
  create();
  Plant sut = open();
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
  EXPECT_FALSE(sut.archive_of("nobody"));
}

}  // namespace
}  // namespace millrace::tools::trust
