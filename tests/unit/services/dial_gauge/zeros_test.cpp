#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/dial_gauge/config.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::dial_gauge {
namespace {

using testing::HasSubstr;

class ZerosFile : public testing::Test {
 protected:
  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "zeros";
};

TEST_F(ZerosFile, ThatIsMissingHoldsNone) {
  EXPECT_EQ(read_zeros(file), Zeros{});
}

TEST_F(ZerosFile, ReturnsWhatWasStored) {
  const Zeros zeros{{"bore", -5}, {"depth", 12'345'000}};
  ASSERT_TRUE(keep_zeros(file, zeros));
  EXPECT_EQ(read_zeros(file), zeros);
}

TEST_F(ZerosFile, ThatIsBrokenIsAnErrorAndNotNoZeros) {
  std::ofstream(file) << "zero { gauge: ";
  EXPECT_THAT(read_zeros(file).error(), HasSubstr("zeros:1:"));
}

TEST_F(ZerosFile, ThatCannotBeWrittenIsAnError) {
  EXPECT_THAT(keep_zeros(folder.path() / "missing" / "zeros", {}).error(),
              HasSubstr("No such file or directory"));
}

}  // namespace
}  // namespace millrace::services::dial_gauge
