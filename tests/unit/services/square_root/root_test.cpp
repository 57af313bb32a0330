#include "services/square_root/root.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/messages.hpp"

namespace millrace::services::square_root {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

struct Case {
  std::string request;
  std::string text;
  std::uint32_t state;
};

class SquareRoot : public testing::TestWithParam<Case> {};

TEST_P(SquareRoot, AnswersAsTheManualDoes) {
  const sdk::Response sut = square_root(GetParam().request);
  EXPECT_EQ(sut.text, GetParam().text);
  EXPECT_EQ(sut.state, GetParam().state);
}

INSTANTIATE_TEST_SUITE_P(
    Requests, SquareRoot,
    testing::Values(Case{"4", "2.000000", 1}, Case{"2", "1.414214", 1}, Case{"0", "0.000000", 1},
                    Case{"-0", "0.000000", 1}, Case{"  2.25\t", "1.500000", 1},
                    Case{"+9", "3.000000", 1}, Case{"1e2", "10.000000", 1},
                    Case{"1e308", "1.000000e+154", 1},
                    Case{"-4", "ERROR: cannot calc square root of negative number -4.000000", 99},
                    Case{"-1e308",
                         "ERROR: cannot calc square root of negative number -1.000000e+308", 99},
                    Case{"abc", "ERROR: 'abc' is not a number", 99},
                    Case{"4 5", "ERROR: '4 5' is not a number", 99},
                    Case{"4,5", "ERROR: '4,5' is not a number", 99},
                    Case{"+-4", "ERROR: '+-4' is not a number", 99},
                    Case{"0x10", "ERROR: '0x10' is not a number", 99},
                    Case{"nan", "ERROR: 'nan' is not a number", 99},
                    Case{"inf", "ERROR: 'inf' is not a number", 99},
                    Case{"$(reboot)", "ERROR: '$(reboot)' is not a number", 99},
                    Case{"../../etc/passwd", "ERROR: '../../etc/passwd' is not a number", 99},
                    Case{"4\x01", "ERROR: '4?' is not a number", 99},
                    Case{"", "ERROR: the request is empty, expected a number", 99},
                    Case{" \n", "ERROR: the request is empty, expected a number", 99},
                    Case{"1e999", "ERROR: '1e999' is out of the range of a number", 99}));

TEST(SquareRootOfAFullRequest, FitsIntoTheAnswer) {
  EXPECT_EQ(square_root(std::string(fabric::max_text, '9')).state, state_ok);
  const sdk::Response sut = square_root(std::string(fabric::max_text, 'x'));
  EXPECT_THAT(sut.text, SizeIs(testing::Le(fabric::max_text)));
  EXPECT_THAT(sut.text, HasSubstr("...' is not a number"));
}

}  // namespace
}  // namespace millrace::services::square_root
