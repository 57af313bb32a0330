#include "gateway/snapshot.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

const PendingRequest pending_request{"uuid", "text", 7};
constexpr std::array<std::uint32_t, 1> interim_5{5};
constexpr std::span<const std::uint32_t> none;

Snapshot whole(const std::string& uuid, const std::string& text, std::uint32_t request_state,
               std::uint32_t response_state) {
  return {ReadSet::request, uuid, text, request_state, response_state, ""};
}

TEST(Judge, SaysThatAnUnchangedRequestIsPending) {
  EXPECT_EQ(judge(whole("uuid", "text", 7, 0), pending_request, none), Standing::pending);
}

TEST(Judge, SaysThatTwoZeroStatesAreACleared) {
  EXPECT_EQ(judge(whole("uuid", "text", 0, 0), pending_request, none), Standing::cleared);
}

TEST(Judge, SeesANewStateAndNewTextsUnderTheSameState) {
  EXPECT_EQ(judge(whole("uuid", "text", 8, 0), pending_request, none), Standing::replaced);
  EXPECT_EQ(judge(whole("uuid", "other", 7, 0), pending_request, none), Standing::replaced);
  EXPECT_EQ(judge(whole("other", "text", 7, 0), pending_request, none), Standing::replaced);
}

TEST(Judge, ComparesOnlyWhatTheLookTookIn) {
  EXPECT_EQ(judge({ReadSet::state, "", "", 7, 0, ""}, pending_request, none), Standing::pending);
  EXPECT_EQ(judge({ReadSet::states, "", "", 7, 0, ""}, pending_request, none), Standing::pending);
}

TEST(Judge, KnowsACallByItsInterimStateWhereTheKernelClearedTheRequest) {
  EXPECT_EQ(judge(whole("uuid", "text", 0, 5), pending_request, interim_5), Standing::pending);
  EXPECT_EQ(judge({ReadSet::states, "", "", 0, 5, ""}, pending_request, interim_5),
            Standing::pending);
  EXPECT_EQ(judge(whole("uuid", "other", 0, 5), pending_request, interim_5), Standing::answered);
}

TEST(Judge, SeesThatSomebodyElseAnswered) {
  EXPECT_EQ(judge(whole("uuid", "text", 0, 1), pending_request, none), Standing::answered);
  EXPECT_EQ(judge(whole("uuid", "text", 0, 1), pending_request, interim_5), Standing::answered);
}

// The texts of a request that was given up are still there when the next one's state is written.
// Found by the simulation.
TEST(Looking, ReadsTheStateOfARequestBeforeItsTexts) {
  for (const ReadSet look : {ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(look);
    const auto state = std::ranges::find(order, Variable::request_state);
    EXPECT_LT(state, std::ranges::find(order, Variable::uuid));
    EXPECT_LT(state, std::ranges::find(order, Variable::request));
  }
}

// A new REQUEST_STATE may clear RESPONSE_STATE.
TEST(Looking, ReadsTheStateOfTheResponseBeforeThatOfTheRequest) {
  for (const ReadSet look : {ReadSet::states, ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(look);
    EXPECT_LT(std::ranges::find(order, Variable::response_state),
              std::ranges::find(order, Variable::request_state));
  }
}

}  // namespace
}  // namespace millrace::gateway
