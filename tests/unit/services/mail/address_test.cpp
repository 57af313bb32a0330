#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/message.hpp"

namespace millrace::services::mail {
namespace {

using testing::HasSubstr;

TEST(MailAddress, HasANameOrNone) {
  EXPECT_EQ(parse_address("eva@example.com"), (Address{.mailbox = "eva@example.com"}));
  EXPECT_EQ(parse_address(" Eva Müller  <eva.m+press@mail.example.com> "),
            (Address{"Eva Müller", "eva.m+press@mail.example.com"}));
  EXPECT_EQ(parse_address("\"Müller, Eva\" <eva@example.com>"),
            (Address{"Müller, Eva", "eva@example.com"}));
  EXPECT_EQ(parse_address("<eva@localhost>"), (Address{.mailbox = "eva@localhost"}));
  EXPECT_EQ(domain_of({.mailbox = "eva@example.com"}), "example.com");
}

class WrongMailAddress : public testing::TestWithParam<std::string> {};

TEST_P(WrongMailAddress, IsRefused) {
  EXPECT_FALSE(parse_address(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Addresses, WrongMailAddress,
                         testing::Values("", "eva", "@example.com", "eva@", "a b@example.com",
                                         "eva@exam ple.com", "eva..m@example.com",
                                         ".eva@example.com", "eva@example.com.", "eva@b>",
                                         "eva@example.com, bob@example.com", "E <eva@a> <b@c>",
                                         "eva@example.com\r\nRCPT TO:<x@y>", "eva@m\xC3\xBC.de",
                                         "Eva\n <eva@example.com>", "E\xFF <eva@example.com>",
                                         std::string(65, 'a') + "@example.com",
                                         "eva@" + std::string(251, 'a')));

TEST(MailAddress, ReportsWhatIsWrong) {
  EXPECT_THAT(parse_address("eva").error(), HasSubstr("'eva' is not an address; expected user@"));
}

}  // namespace
}  // namespace millrace::services::mail
