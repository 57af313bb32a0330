#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/compose.hpp"

namespace millrace::services::mail {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

TEST(MailRequest, HasATemplateAndValues) {
  const auto sut = parse("done program=WELLE7 parts=12");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->template_name, "done");
  EXPECT_THAT(sut->values, ElementsAre(Pair("parts", "12"), Pair("program", "WELLE7")));
  EXPECT_THAT(sut->to, IsEmpty());
}

TEST(MailRequest, ConvertsItsValuesToUtf8) {
  EXPECT_THAT(parse("a text=\"Ma\xDF 1\"")->values, ElementsAre(Pair("text", "Maß 1")));
}

TEST(MailRequest, MayNameRecipients) {
  const auto sut = parse("\talarm to=shift2,boss  why=oil");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_THAT(sut->to, ElementsAre("shift2", "boss"));
  EXPECT_THAT(sut->values, ElementsAre(Pair("why", "oil")));
}

struct Mistake {
  std::string request;
  std::string error;
};

class WrongMailRequest : public testing::TestWithParam<Mistake> {};

TEST_P(WrongMailRequest, ReportsWhatIsWrong) {
  const auto sut = parse(GetParam().request);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Requests, WrongMailRequest,
    testing::Values(Mistake{"", "the request is empty"}, Mistake{" \t", "the request is empty"},
                    Mistake{"/etc/passwd", "no template can be called '/etc/passwd'"},
                    Mistake{"$(reboot)", "no template can be called '$(reboot)'"},
                    Mistake{"done program", "expected key=value at 'program'"},
                    Mistake{"done a=1 a=2", "key 'a' occurs twice"},
                    Mistake{"done a=\"1", "no closing quote"},
                    Mistake{"done a=\"1\nBcc: x\"", "byte 10 of the request (0x0A) is not text"},
                    Mistake{"done a=1\rb", "byte 9 of the request (0x0D) is not text"},
                    Mistake{std::string("done a=\0", 8), "byte 8 of the request (0x00)"},
                    Mistake{"done a=\x81", "byte 8 of the request (0x81)"},
                    Mistake{"done to=", "no recipient can be called ''"},
                    Mistake{"done to=a,,b", "no recipient can be called ''"},
                    Mistake{"done to=x@evil.example", "no recipient can be called 'x@evil"},
                    Mistake{std::string(127, '\xFF'), "no template can be called"},
                    Mistake{std::string(127, 'a'), "no template can be called"}));

}  // namespace
}  // namespace millrace::services::mail
