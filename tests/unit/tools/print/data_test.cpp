#include "tools/print/data.hpp"

#include <limits>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "tools/print/json.hpp"

namespace millrace::tools::print {
namespace {

using fabric::Quality;
using fabric::Value;
using fabric::ValueType;

Value real(double value) {
  return {.name = "X", .type = ValueType::real64, .elements = std::vector<double>{value}};
}

TEST(AValue, IsShownAsItsTypeWritesIt) {
  EXPECT_EQ(text_of(real(3.5)), "3.5");
  Value truth{.type = ValueType::boolean, .elements = std::vector<std::int64_t>{1}};
  EXPECT_EQ(text_of(truth), "TRUE");
  truth.type = ValueType::uns08;
  EXPECT_EQ(text_of(truth), "1");
  Value texts{.type = ValueType::string,
              .is_array = true,
              .elements = std::vector<std::string>{"Ma\xDF", "\x1B[2J"}};
  EXPECT_EQ(text_of(texts), "[\"Ma\u00DF\", \"\\x1b[2J\"]");
  EXPECT_EQ(text_of(Value{}), "-");
}

TEST(Json, HasNumbersInTheirShortestForm) {
  const std::string text =
      R"({"a \"b\"":[10,-0.5,1e+300,{}],"n":null,"t":[true,"x\\\n\u0001ä",[]],"u":18446744073709551615})";
  EXPECT_EQ(json_text(boost::json::parse(text)), text);
  EXPECT_EQ(json_text(boost::json::value(10.0)), "10");
  EXPECT_EQ(json_text(boost::json::value(0.0)), "0");
  EXPECT_EQ(json_text(boost::json::value(std::numeric_limits<double>::quiet_NaN())), "null");
}

TEST(AValue, IsJsonWhateverItHolds) {
  EXPECT_EQ(json_text(json_of_elements(real(0.1))), "0.1");
  EXPECT_EQ(json_text(json_of_elements(real(std::numeric_limits<double>::infinity()))), "\"inf\"");
  EXPECT_EQ(json_text(json_of_elements(Value{})), "null");
  EXPECT_EQ(json_text(json_of_elements(
                {.type = ValueType::boolean, .elements = std::vector<std::int64_t>{0}})),
            "false");
}

TEST(ASampleLine, ShowsWhatIsNotGoodWithTheReason) {
  fabric::DataSample sample{.group = "axes", .values = {real(1), real(2)}};
  sample.values[1].quality = Quality::stale;
  sample.values[1].reason = "the link is down";
  EXPECT_EQ(line_of(sample), "axes  X=1  X=2 (stale: the link is down)");
  EXPECT_EQ(line_of(fabric::DataSample{.group = "axes"}), "axes  not published any more");
}

TEST(AProgramLine, ShowsHowItEndedAndHowLongItTook) {
  const fabric::Time began(std::chrono::seconds(100));
  EXPECT_EQ(line_of(fabric::ProgramEvent{.kind = fabric::ProgramEventKind::aborted,
                                         .at = began + std::chrono::seconds(12),
                                         .started = began,
                                         .program = "a\nb",
                                         .error = 21462,
                                         .parts = 3,
                                         .mode = 2}),
            "aborted  \"a\\x0ab\"  error 21462  after 12.0 s  3 parts  automatic");
  EXPECT_EQ(line_of(fabric::ProgramEvent{.replayed = true}), "started  (replayed)");
}

}  // namespace
}  // namespace millrace::tools::print
