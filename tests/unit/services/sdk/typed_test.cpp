// Typed requests and answers, and UTF-8.
#include "services/sdk/typed.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "services/sdk/testing/fake_call.hpp"

// In services::sdk the name `testing` would be ambiguous.
namespace millrace {
namespace {

namespace sdk = services::sdk;
using sdk::Call;
using sdk::Response;
using sdk::testing::FakeCall;

const sdk::Handler root = sdk::typed<double, double>(
    [](const Call& call) {
      try {
        return std::stod(call.text());
      } catch (const std::exception&) {
        throw std::invalid_argument("'" + call.text() + "' is not a number");
      }
    },
    [](double number, const Call&) {
      if (number < 0) {
        throw std::domain_error("the root of a negative number");
      }
      return std::sqrt(number);
    },
    [](double answer) { return Response{.text = std::to_string(answer)}; });

TEST(ATypedService, ParsesWorksAndFormats) {
  EXPECT_EQ(FakeCall({.text = "2.25"}).run(root)->text, "1.500000");
}

TEST(ATypedService, DistinguishesAWrongRequestFromAFailure) {
  const auto wrong = FakeCall({.text = "x"}).run(root);
  EXPECT_EQ(wrong->text, "ERROR: 'x' is not a number");
  EXPECT_EQ(wrong->state, sdk::bad_request_state);
  const auto failed = FakeCall({.text = "-1"}).run(root);
  EXPECT_EQ(failed->text, "ERROR: the root of a negative number");
  EXPECT_EQ(failed->state, sdk::default_error_state);
}

TEST(ATypedService, AnswersALongWrongRequestWithATextThatFits) {
  const auto reply = FakeCall({.text = std::string(127, 'x')}).run(root);
  EXPECT_EQ(reply->state, sdk::bad_request_state);
  EXPECT_EQ(reply->text.size(), 127U);
  EXPECT_TRUE(reply->text.ends_with("..."));
}

TEST(ATypedService, MayServeTheProcess) {
  std::string help = "--help";
  std::string name = "root";
  char* arguments[] = {name.data(), help.data(), nullptr};
  testing::internal::CaptureStdout();
  EXPECT_EQ(
      (sdk::serve<std::string, std::string>(
          2, arguments, {.uuid = "u", .name = "echo"}, [](const Call& call) { return call.utf8(); },
          [](const std::string& text, const Call&) { return text; },
          [](const std::string& text) { return Response::utf8(text); })),
      0);
  EXPECT_NE(testing::internal::GetCapturedStdout().find("The millrace service echo"),
            std::string::npos);
}

TEST(ACall, HasItsTextInUtf8) {
  const FakeCall call({.text = "Ma\xDF 1 \x80"});
  EXPECT_EQ(static_cast<const Call&>(call).utf8(), "Maß 1 €");
}

TEST(AResponse, IsMadeOfUtf8) {
  EXPECT_EQ(Response::utf8("Maß 1", 7), (Response{"Ma\xDF 1", 7}));
  const auto reply =
      FakeCall().run([](const Call&) -> Response { return Response::utf8("Maß 中"); });
  EXPECT_EQ(reply->text, "ERROR: the service's answer: U+4E2D at byte 6 is not in CP1252");
}

}  // namespace
}  // namespace millrace
