// Each message is called once and in its order, wherever a gateway, a service or the queue itself
// restarts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/queue_fixture.hpp"

namespace millrace::gateway {
namespace {

using queues::Acknowledge;
using testing::ElementsAre;
using testing::IsEmpty;

class EachAcknowledge : public testing::TestWithParam<Acknowledge> {};
INSTANTIATE_TEST_SUITE_P(Of, EachAcknowledge,
                         testing::Values(Acknowledge::when_journalled, Acknowledge::when_answered),
                         [](const auto& acknowledge) {
                           return acknowledge.param == Acknowledge::when_journalled
                                      ? "Journalled"
                                      : "WhenAnswered";
                         });

TEST_P(EachAcknowledge, CallsEachMessageInItsOrderFromEveryIndexOn) {
  for (const std::uint32_t elements : {3U, 4U, 7U}) {
    for (std::uint32_t begin = 1; begin <= elements; ++begin) {
      QueueFixture sut(elements, GetParam());
      sut.ring.last_filled = sut.ring.last_get = begin;
      sut.serve();
      ASSERT_TRUE(sut.settle());
      int last = 0;
      for (int round = 0; round < 5; ++round) {
        while (sut.ring.write(std::to_string(last + 1))) {
          ++last;
        }
        ASSERT_TRUE(sut.settle());
        ASSERT_FALSE(sut.ring.full());
        ASSERT_EQ(sut.ring.last_get, sut.ring.last_filled);
      }
      EXPECT_EQ(texts_of(sut), numbers(1, last)) << elements << " elements from " << begin;
      EXPECT_THAT(sut.troubles, IsEmpty());
    }
  }
}

TEST_P(EachAcknowledge, CountsTwoMessagesOfOneTextAsTwo) {
  QueueFixture sut(4, GetParam());
  sut.serve();
  ASSERT_TRUE(sut.settle());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(sut.ring.write("same"));
  }
  ASSERT_TRUE(sut.settle());
  ASSERT_THAT(texts_of(sut), ElementsAre("same", "same", "same"));
  EXPECT_NE(sut.executed[0].first, sut.executed[1].first);
}

TEST_P(EachAcknowledge, LosesNothingAndRepeatsUnderTheSameIdWhereverTheGatewayIsKilled) {
  for (const std::uint32_t elements : {3U, 5U}) {
    for (int at = 0; at < 160; ++at) {
      QueueFixture sut(elements, GetParam());
      run_with(sut, at, 7, [&](int) { sut.crash(); });
      // A service knows a call that it has run by its id: a message that runs once was called with
      // one id.
      ASSERT_EQ(texts_of(sut), numbers(1, 7)) << elements << " elements, killed in step " << at;
      ASSERT_EQ(sut.ring.last_get, sut.ring.last_filled) << at;
    }
  }
}

TEST_P(EachAcknowledge, LosesNothingWhereverTheGatewayIsKilledTwice) {
  for (int at = 0; at < 90; ++at) {
    for (const int later : {1, 2, 5, 9}) {
      QueueFixture sut(3, GetParam());
      run_with(sut, at, 5, [&](int) {
        sut.crash();
        for (int i = 0; i < later; ++i) {
          sut.step();
        }
        sut.crash();
      });
      ASSERT_EQ(texts_of(sut), numbers(1, 5))
          << "killed in step " << at << " and " << later << " later";
    }
  }
}

TEST_P(EachAcknowledge, RepeatsUnderTheSameIdWhereverTheServiceIsKilled) {
  for (int at = 0; at < 120; ++at) {
    QueueFixture sut(3, GetParam());
    run_with(sut, at, 6, [&](int) { sut.kill_service(); });
    std::map<fabric::CallId, std::string> calls;
    std::vector<std::string> first;
    for (const auto& [call, text] : sut.executed) {
      if (calls.emplace(call, text).second) {
        first.push_back(text);
      }
    }
    // The new service does not know what the old one has run; the id shows it.
    ASSERT_EQ(first, numbers(1, 6)) << "killed in step " << at;
    ASSERT_LE(sut.executed.size(), 7U) << at;
  }
}

TEST_P(EachAcknowledge, ContinuesWhereverAProgramInitialisesTheQueue) {
  int unseen = 0;
  for (int at = 0; at < 120; ++at) {
    QueueFixture sut(4, GetParam());
    int before = 0;
    run_with(sut, at, 8, [&](int written) {
      before = written;
      sut.ring.initialise();
    });
    // The unread messages are gone with the queue, as its program wanted; later ones are not.
    ASSERT_EQ(sut.ring.last_get, sut.ring.last_filled) << at;
    if (sut.unseen_at_write) {
      ++unseen;
      continue;
    }
    const auto texts = texts_of(sut);
    for (const std::string& number : numbers(before + 1, 8)) {
      const auto times = std::ranges::count(texts, number);
      ASSERT_GE(times, 1) << number << ", initialised in step " << at << " after " << before << ": "
                          << testing::PrintToString(texts);
    }
    ASSERT_TRUE(std::ranges::is_sorted(texts)) << at << testing::PrintToString(texts);
    ASSERT_EQ(std::ranges::adjacent_find(texts), texts.end()) << at;
  }
  // One step in each round, between the read and the write of LastGet.
  EXPECT_LE(unseen, 15);
}

}  // namespace
}  // namespace millrace::gateway
