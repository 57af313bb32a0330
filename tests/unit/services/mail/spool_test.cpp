#include "services/mail/spool.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/spool_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::mail {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

Entry entry(std::uint64_t number) {
  return {.call = {.epoch = 0x5f, .number = number},
          .stage = Stage::waiting,
          .mail = {.from = "a@b", .to = {"c@d", "e@f"}, .message = "Subject: x\r\n\r\n\xC3\x9F"},
          .made = fabric::Time(std::chrono::nanoseconds(17)),
          .attempts = 2,
          .next = fabric::Time(std::chrono::nanoseconds(18)),
          .reply = "451 \"busy\""};
}

TEST(MailSpool, GivesBackWhatWasPut) {
  const tests::TemporaryFolder folder;
  {
    const Spool sut(folder.path() / "spool");
    EXPECT_TRUE(sut.put(entry(1)));
    EXPECT_TRUE(sut.put(entry(2)));
    EXPECT_TRUE(sut.put(entry(3)));
    EXPECT_TRUE(sut.remove({.epoch = 0x5f, .number = 3}));
  }
  const Spool sut(folder.path() / "spool");
  EXPECT_THAT(sut.read().entries, UnorderedElementsAre(entry(1), entry(2)));
  EXPECT_THAT(sut.read().mistakes, IsEmpty());
}

TEST(MailSpool, KnowsTheCallOfABrokenFileAndNeverSendsIt) {
  const tests::TemporaryFolder folder;
  const Spool sut(folder.path());
  std::ofstream(folder.path() / "5f-4.mail") << "epoch: 95 numb";
  std::ofstream(folder.path() / "5f-5.mail");
  std::ofstream(folder.path() / "5f-6.mail") << to_file(entry(7));
  const auto content = sut.read();
  EXPECT_THAT(content.mistakes,
              UnorderedElementsAre(HasSubstr("5f-4.mail:1:"), HasSubstr("5f-5.mail: "),
                                   HasSubstr("5f-6.mail: is of call 5f-7")));
  EXPECT_EQ(content.entries.size(), 3U);
  for (const Entry& found : content.entries) {
    EXPECT_EQ(found.stage, Stage::handed_over);
  }
}

TEST(MailSpool, LeavesOtherFilesAlone) {
  const tests::TemporaryFolder folder;
  const Spool sut(folder.path());
  for (const char* name :
       {"readme", "x.mail", "5f.mail", "5f-.mail", "5g-1.mail", "5f-1.mail.part"}) {
    std::ofstream(folder.path() / name) << "x";
  }
  EXPECT_THAT(sut.read().entries, IsEmpty());
  EXPECT_THAT(sut.read().mistakes, IsEmpty());
}

TEST(MailSpool, BelongsToOneService) {
  const tests::TemporaryFolder folder;
  const Spool sut(folder.path());
  EXPECT_THROW(Spool(folder.path()), std::runtime_error);
}

TEST(MailSpoolFile, TellsEveryStageApart) {
  for (const Stage stage :
       {Stage::waiting, Stage::handed_over, Stage::accepted, Stage::refused, Stage::given_up}) {
    Entry with = entry(1);
    with.stage = stage;
    EXPECT_EQ(from_file(to_file(with), "file"), with);
  }
}

TEST(MailSpoolFile, RefusesAMailThatIsToNobody) {
  Entry nobody = entry(1);
  nobody.mail.to.clear();
  EXPECT_THAT(from_file(to_file(nobody), "file").error(), HasSubstr("no sender or recipient"));
}

TEST(MailSpoolFile, IsNamedByItsCall) {
  EXPECT_EQ(file_name({.epoch = 0x5f, .number = 17}), "5f-17.mail");
  EXPECT_EQ(call_of("5f-17.mail"), (fabric::CallId{.epoch = 0x5f, .number = 17}));
}

}  // namespace
}  // namespace millrace::services::mail
