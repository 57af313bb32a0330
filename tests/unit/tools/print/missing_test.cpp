#include <gtest/gtest.h>

#include "tools/print/recording_report.hpp"

namespace millrace::tools::print {
namespace {

TEST(TextOfMissingSamples, ReportsThatNothingIsMissing) {
  EXPECT_EQ(missing_text({.complete = 5000}), "5000 calls are complete");
  EXPECT_EQ(missing_text({.complete = 1}), "1 call is complete");
}

TEST(TextOfMissingSamples, NamesWhatIsMissing) {
  EXPECT_EQ(
      missing_text(
          {.complete = 7, .incomplete = 2, .unseen = 3, .requests = 1, .replies = 0, .events = 4}),
      "7 calls are complete; 2 calls are incomplete: at least 1 request, 0 replies "
      "and 4 events are missing; 3 calls were not received");
}

}  // namespace
}  // namespace millrace::tools::print
