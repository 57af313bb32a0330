#include "fabric/words.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

TEST(Words, NameEveryEnumerator) {
  EXPECT_EQ(name_of(ReplyKind::final), "final");
  EXPECT_EQ(name_of(ServiceCode::refused), "refused");
  EXPECT_EQ(name_of(ChannelState::link_down), "link down");
  EXPECT_EQ(name_of(ChannelState::held), "held");
  EXPECT_EQ(name_of(EventKind::seen), "seen");
  EXPECT_EQ(name_of(EventKind::held), "held");
  EXPECT_EQ(name_of(CommandKind::ping), "ping");
}

TEST(Words, NameAnUnknownValueAsUnknown) {
  EXPECT_EQ(name_of(static_cast<EventKind>(11)), "unknown");
  EXPECT_EQ(name_of(static_cast<Delivery>(2)), "unknown");
}

TEST(Words, OfDeliveryAreReadAsTheyAreWritten) {
  for (const Delivery delivery : {Delivery::at_least_once, Delivery::at_most_once}) {
    EXPECT_EQ(parse_delivery(name_of(delivery)), delivery);
  }
  for (const CompletionSignal completion_signal :
       {CompletionSignal::response_state, CompletionSignal::response}) {
    EXPECT_EQ(parse_completion_signal(name_of(completion_signal)), completion_signal);
  }
  EXPECT_EQ(parse_delivery("at most once"), std::nullopt);
  EXPECT_EQ(parse_delivery(""), std::nullopt);
}

}  // namespace
}  // namespace millrace::fabric
