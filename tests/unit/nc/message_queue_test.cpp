// The writing side of a message queue: the position of the next message, and the order of the
// writes.
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cnc/nc/run/system_data.hpp"

namespace millrace::cnc::nc::run {
namespace {

/// Records the writes, in their order.
class Notes final : public Environment {
 public:
  explicit Notes(long filled, long got) {
    values_["SD.C.LastFilled"] = static_cast<double>(filled);
    values_["SD.C.LastGet"] = static_cast<double>(got);
  }
  tl::expected<Value, Fault> read(std::string_view name) override {
    return values_.at(std::string(name));
  }
  tl::expected<void, Fault> write(std::string_view name, const Value& value) override {
    written.emplace_back(name);
    values_[std::string(name)] = value;
    return {};
  }
  std::size_t elements(std::string_view) override { return 3; }
  tl::expected<std::string, Fault> load(std::string_view) override { return std::string(); }

  std::vector<std::string> written;

 private:
  std::map<std::string, Value> values_;
};

using Names = std::vector<std::string>;

TEST(MessageQueue, WritesTheElementBeforeLastFilled) {
  Notes sut(1, 1);
  ASSERT_TRUE(carry_out(WriteMessage{"SD.Q", "SD.C", "text"}, sut));
  EXPECT_EQ(sut.written, (Names{"SD.Q[2]", "SD.C.LastFilled"}));
}

TEST(MessageQueue, WritesNothingWhereItIsFull) {
  Notes sut(3, 1);
  EXPECT_FALSE(carry_out(WriteMessage{"SD.Q", "SD.C", "text"}, sut));
  EXPECT_EQ(sut.written, Names{});
}

TEST(MessageQueue, HoldsOneMessageLessThanItHasElementsFromEveryIndexOn) {
  for (const long elements : {3L, 4L, 100L}) {
    for (long begin = 1; begin <= elements; ++begin) {
      QueueControl sut{begin, begin};
      for (long message = 1; message < elements; ++message) {
        const auto next = next_position(sut, elements);
        ASSERT_TRUE(next) << elements << ' ' << begin << ' ' << message;
        EXPECT_EQ(*next, (begin + message - 1) % elements + 1);
        sut.last_filled = *next;
      }
      EXPECT_FALSE(next_position(sut, elements)) << elements << ' ' << begin;
    }
  }
}

TEST(MessageQueue, HasNoPositionOutsideItsArray) {
  EXPECT_FALSE(next_position({0, 0}, 3));
  EXPECT_FALSE(next_position({4, 1}, 3));
  EXPECT_FALSE(next_position({1, -1}, 3));
  EXPECT_FALSE(next_position({1, 1}, 2));
  EXPECT_FALSE(next_position({1, 1}, 0));
}

}  // namespace
}  // namespace millrace::cnc::nc::run
