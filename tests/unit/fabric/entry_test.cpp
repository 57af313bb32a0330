#include "fabric/observer/entry.hpp"

#include <set>

#include <gtest/gtest.h>

namespace millrace::fabric::observer {
namespace {

TEST(AnEntry, IsAFailureIfItsReplySaysThatTheCallHasFailed) {
  const std::set failures{ServiceCode::failed, ServiceCode::refused};
  for (const ServiceCode code :
       {ServiceCode::ok, ServiceCode::failed, ServiceCode::repeated, ServiceCode::refused}) {
    EXPECT_EQ(is_failure(Entry{.sample = Reply{.code = code}}), failures.contains(code))
        << static_cast<int>(code);
  }
}

TEST(AnEntry, IsAFailureIfItsEventIsOne) {
  const std::set failures{EventKind::lost, EventKind::refused, EventKind::held};
  for (const EventKind kind :
       {EventKind::seen, EventKind::unserved, EventKind::dispatched, EventKind::interim,
        EventKind::replied, EventKind::written, EventKind::withdrawn, EventKind::lost,
        EventKind::late, EventKind::refused, EventKind::held}) {
    EXPECT_EQ(is_failure(Entry{.sample = Event{.kind = kind}}), failures.contains(kind))
        << static_cast<int>(kind);
  }
}

TEST(AnEntry, IsNoFailureWithoutAReplyAndAnEvent) {
  EXPECT_FALSE(is_failure(Entry{.sample = Request{}}));
  EXPECT_FALSE(is_failure(Entry{.sample = ChannelStatus{.state = ChannelState::held}}));
}

}  // namespace
}  // namespace millrace::fabric::observer
