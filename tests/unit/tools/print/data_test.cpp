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

}  // namespace
}  // namespace millrace::tools::print
