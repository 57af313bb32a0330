#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/answering.hpp"

namespace millrace::services::archiver {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(ArchiverRequest, HasFieldsBehindPut) {
  EXPECT_THAT(*parse("PUT part=WELLE7 d=12.345"),
              ElementsAre(Field{"part", "WELLE7"}, Field{"d", "12.345"}));
  EXPECT_THAT(*parse("  put \t a=1  b= "), ElementsAre(Field{"a", "1"}, Field{"b", ""}));
}

TEST(ArchiverRequest, MayQuoteValues) {
  EXPECT_THAT(*parse(R"(PUT d="12.345 mm" say="we said ""no""" none="" e=a=b)"),
              ElementsAre(Field{"d", "12.345 mm"}, Field{"say", "we said \"no\""},
                          Field{"none", ""}, Field{"e", "a=b"}));
}

TEST(ArchiverRequest, IsTextOtherwise) {
  EXPECT_THAT(*parse("tool 5 changed; a=1 $(reboot)"), IsEmpty());
  EXPECT_THAT(*parse("PUTTING a=1"), IsEmpty());
}

struct Mistake {
  std::string request;
  std::string error;
};

class WrongArchiverRequest : public testing::TestWithParam<Mistake> {};

TEST_P(WrongArchiverRequest, ReportsWhatIsWrong) {
  const auto sut = parse(GetParam().request);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Requests, WrongArchiverRequest,
    testing::Values(Mistake{"", "the request is empty"}, Mistake{"  \t ", "the request is empty"},
                    Mistake{"PUT", "PUT without key=value"},
                    Mistake{"PUT a", "expected key=value at 'a'"},
                    Mistake{"PUT =1", "expected key=value at '=1'"},
                    Mistake{"PUT a=1 b c=2", "expected key=value at 'b c=2'"},
                    Mistake{"PUT a.b=1", "expected key=value at 'a.b=1'"},
                    Mistake{"PUT a=1 a=2", "key 'a' occurs twice"},
                    Mistake{"PUT a=\"1", "no closing quote for '\"1'"},
                    Mistake{"PUT a=\"1\"b=2", "expected a blank at 'b=2'"},
                    Mistake{"PUT " + std::string(33, 'k') + "=1", "expected key=value"},
                    Mistake{"PUT " + std::string(123, '\xFF'), "expected key=value"}));

}  // namespace
}  // namespace millrace::services::archiver
