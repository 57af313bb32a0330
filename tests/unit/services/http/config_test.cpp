#include "services/http/config.hpp"

#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::http {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class HttpConfig : public testing::Test {
 protected:
  [[nodiscard]] tl::expected<std::vector<Endpoint>, std::string> loaded(
      const std::string& more) const {
    std::ofstream(folder.path() / "http.textproto")
        << "service { uuid: '1B671A64-40D5-491E-99B0-DA01FF1F3341' " << more << " }";
    return load(folder.path() / "http.textproto");
  }
  fs::path write(const std::string& name, const std::string& text, fs::perms mode) const {
    std::ofstream(folder.path() / name) << text;
    fs::permissions(folder.path() / name, mode);
    return folder.path() / name;
  }

  tests::TemporaryFolder folder;
  static constexpr fs::perms own = fs::perms::owner_read | fs::perms::owner_write;
};

TEST_F(HttpConfig, MakesAnEndpointOfEachUrl) {
  const auto sut =
      loaded("url: 'http://a:8000/x?y=1' url: 'https://b/x' health: '/ok' channel: 'cnc/1'")
          .value();
  ASSERT_EQ(sut.size(), 2U);
  EXPECT_EQ(sut[0].announcement.uuid, "1b671a64-40d5-491e-99b0-da01ff1f3341");
  EXPECT_EQ(sut[0].announcement.name, "a:8000");
  EXPECT_EQ(sut[0].announcement.description, "http://a:8000/x?y=1");
  EXPECT_EQ(sut[0].health_url, "http://a:8000/ok");
  EXPECT_EQ(sut[1].announcement.name, "b:443");
  EXPECT_EQ(sut[1].health_url, "https://b:443/ok");
  EXPECT_EQ(sut[0].announcement.delivery, fabric::Delivery::at_most_once);
}

TEST(AnHttpConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("http", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

TEST_F(HttpConfig, ReadsItsSecrets) {
  write("token", "abc\n", own);
  write("secret", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n", own);
  const auto sut = with_secrets(
      loaded("url: 'https://b' bearer_token_file: 'token' signing_secret_file: 'secret'").value());
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->front().bearer_token.contents, "abc");
  EXPECT_EQ(sut->front().signing_secret.contents.size(), 24U);
  EXPECT_EQ(files_of("c", *sut).size(), 3U);
}

TEST_F(HttpConfig, RefusesASecretThatOtherUsersCanRead) {
  const fs::path token = write("token", "abc\n", own | fs::perms::others_read);
  const auto sut = with_secrets(loaded("url: 'https://b' bearer_token_file: 'token'").value());
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(),
              HasSubstr(token.string() + ": is a secret, and all users of this host can read it"));
}

TEST_F(HttpConfig, RefusesASecretThatCannotBeSent) {
  const auto error = [&](const std::string& field, const std::string& text) {
    write("file", text, own);
    const auto sut =
        with_secrets(loaded(fmt::format("url: 'https://b' {}: 'file'", field)).value());
    return sut ? "" : sut.error();
  };
  EXPECT_THAT(error("bearer_token_file", "\nabc"), HasSubstr("its first line is empty"));
  EXPECT_THAT(error("bearer_token_file", "a b"), HasSubstr("has blanks"));
  EXPECT_THAT(error("signing_secret_file", "whsec_YWJj"), HasSubstr("Base64 of 24 to 64 bytes"));
  EXPECT_THAT(error("signing_secret_file", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"),
              HasSubstr("expected whsec_"));
  EXPECT_THAT(error("signing_secret_file", "whsec_!!!!!!!!!!!!!!!!!!!!!!!!!!!!!!!!"),
              HasSubstr("Base64 of 24 to 64 bytes"));
}

}  // namespace
}  // namespace millrace::services::http
