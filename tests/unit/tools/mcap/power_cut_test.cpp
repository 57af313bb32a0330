// The contents of a recording after a power cut at any point of its work.
#include <gtest/gtest.h>

#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/mcap/file.hpp"

namespace millrace::tools::mcap {
namespace {

TEST(RecordingAfterAPowerCut, HasWhatWasSyncedAndIsWholeOnceItIsFinished) {
  const millrace::tests::TemporaryFolder folder;
  const std::string chunk(1000, 'x');
  constexpr unsigned chunks = 5;
  const std::string all((chunks + 1) * chunk.size(), 'x');
  millrace::tests::PowerCutDisk disk(folder.path());
  {
    auto sut = FileSink::create(folder.path() / "run.mcap");
    ASSERT_TRUE(sut);
    for (unsigned done = 1; done <= chunks; ++done) {
      ASSERT_TRUE(sut->write(chunk));
      ASSERT_TRUE(sut->sync());
      disk.promise(done);
    }
    // What was not forced yet is forced before the file gets its name.
    ASSERT_TRUE(sut->write(chunk));
    ASSERT_TRUE(sut->finish());
    disk.promise(chunks + 1);
  }
  for (const millrace::tests::PowerCut& cut : disk.power_cuts()) {
    const auto part = cut.files.find("run.mcap.part");
    const auto whole = cut.files.find("run.mcap");
    const bool finished = whole != cut.files.end();
    EXPECT_TRUE(finished || cut.promised <= chunks) << cut.where;
    if (finished) {
      EXPECT_TRUE(whole->second == all) << cut.where;
    } else if (cut.promised > 0) {
      ASSERT_NE(part, cut.files.end()) << cut.where;
      EXPECT_GE(part->second.size(), cut.promised * chunk.size()) << cut.where;
    }
  }
}

}  // namespace
}  // namespace millrace::tools::mcap
