// The contents of the spool after a power cut at any point of its work.
#include <gtest/gtest.h>

#include "services/mail/spool.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::mail {
namespace {

Entry at_stage(std::uint64_t number, Stage stage) {
  return {.call = {.epoch = 0x5f, .number = number},
          .stage = stage,
          .mail = {.from = "a@b", .to = {"c@d"}, .message = "Subject: x\r\n"}};
}

// A handed-over mail that is missing in the spool would be sent twice.
TEST(MailSpoolAfterAPowerCut, HasWhatWasPutAndNothingThatWasRemoved) {
  const tests::TemporaryFolder folder;
  const auto spool = folder.path() / "spool";
  std::filesystem::create_directory(spool);
  std::vector<Entry> puts;
  for (std::uint64_t number = 1; number <= 4; ++number) {
    for (const Stage stage : {Stage::waiting, Stage::handed_over, Stage::accepted}) {
      puts.push_back(at_stage(number, stage));
    }
  }
  std::vector<tests::PowerCut> cuts;
  {
    tests::PowerCutDisk disk(spool);
    Spool writer(spool);
    for (unsigned done = 0; done < puts.size(); ++done) {
      ASSERT_TRUE(writer.put(puts[done]));
      disk.promise(done + 1);
    }
    ASSERT_TRUE(writer.remove(puts.front().call));
    disk.promise(static_cast<unsigned>(puts.size()) + 1);
    cuts = disk.power_cuts();
  }
  ASSERT_GT(cuts.size(), puts.size());
  for (const tests::PowerCut& cut : cuts) {
    cut.restore(folder.path() / "left");
    const Spool sut(folder.path() / "left");
    // One more than promised may be present.
    bool as_promised = false;
    for (unsigned done = cut.promised; done <= cut.promised + 1; ++done) {
      std::map<fabric::CallId, Entry> expected;
      for (unsigned i = 0; i < std::min<std::size_t>(done, puts.size()); ++i) {
        expected.insert_or_assign(puts[i].call, puts[i]);
      }
      if (done > puts.size()) {
        expected.erase(puts.front().call);
      }
      bool all = true;
      for (std::uint64_t number = 1; number <= 4; ++number) {
        const fabric::CallId call{.epoch = 0x5f, .number = number};
        const auto found = sut.find(call);
        ASSERT_TRUE(found) << cut.where << ": " << found.error();
        const auto known = expected.find(call);
        all = all && (known == expected.end() ? !*found : *found == known->second);
      }
      as_promised = as_promised || all;
    }
    EXPECT_TRUE(as_promised) << cut.where << ", after " << cut.promised << " of " << puts.size();
  }
}

}  // namespace
}  // namespace millrace::services::mail
