#include "gateway/service_snapshot.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

const PendingRequest pending_request{"uuid", "text", 7};
constexpr std::array<std::uint32_t, 1> interim_5{5};
constexpr std::span<const std::uint32_t> none;

ServiceSnapshot whole(const std::string& uuid, const std::string& text, std::uint32_t request_state,
                      std::uint32_t response_state) {
  return {ReadSet::request, uuid, text, request_state, response_state, ""};
}

TEST(Compare, ReportsAnUnchangedRequestAsPending) {
  EXPECT_EQ(compare(whole("uuid", "text", 7, 0), pending_request, none), RequestStatus::pending);
}

TEST(Compare, ReportsTwoZeroStatesAsWithdrawn) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 0), pending_request, none), RequestStatus::withdrawn);
}

TEST(Compare, SeesANewStateAndNewTextsUnderTheSameState) {
  EXPECT_EQ(compare(whole("uuid", "text", 8, 0), pending_request, none), RequestStatus::replaced);
  EXPECT_EQ(compare(whole("uuid", "other", 7, 0), pending_request, none), RequestStatus::replaced);
  EXPECT_EQ(compare(whole("other", "text", 7, 0), pending_request, none), RequestStatus::replaced);
}

TEST(Compare, ComparesOnlyWhatWasRead) {
  EXPECT_EQ(compare({ReadSet::state, "", "", 7, 0, ""}, pending_request, none),
            RequestStatus::pending);
  EXPECT_EQ(compare({ReadSet::states, "", "", 7, 0, ""}, pending_request, none),
            RequestStatus::pending);
}

TEST(Compare, RecognisesACallByItsInterimStateWhereTheKernelClearedTheRequest) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 5), pending_request, interim_5),
            RequestStatus::pending);
  EXPECT_EQ(compare({ReadSet::states, "", "", 0, 5, ""}, pending_request, interim_5),
            RequestStatus::pending);
  EXPECT_EQ(compare(whole("uuid", "other", 0, 5), pending_request, interim_5),
            RequestStatus::answered);
}

TEST(Compare, DetectsAnAnswerOfAnotherClient) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 1), pending_request, none), RequestStatus::answered);
  EXPECT_EQ(compare(whole("uuid", "text", 0, 1), pending_request, interim_5),
            RequestStatus::answered);
}

// A regression: the texts of an abandoned request are still there when the next one's state is
// written. Found by the simulation.
TEST(Snapshot, ReadsTheStateOfARequestBeforeItsTexts) {
  for (const ReadSet set : {ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(set);
    const auto state = std::ranges::find(order, Variable::request_state);
    EXPECT_LT(state, std::ranges::find(order, Variable::uuid));
    EXPECT_LT(state, std::ranges::find(order, Variable::request));
  }
}

// A new REQUEST_STATE may clear RESPONSE_STATE.
TEST(Snapshot, ReadsTheStateOfTheResponseBeforeThatOfTheRequest) {
  for (const ReadSet set : {ReadSet::states, ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(set);
    EXPECT_LT(std::ranges::find(order, Variable::response_state),
              std::ranges::find(order, Variable::request_state));
  }
}

}  // namespace
}  // namespace millrace::gateway
