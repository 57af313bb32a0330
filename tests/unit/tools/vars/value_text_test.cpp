#include <limits>

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <gtest/gtest.h>

#include "tools/commands/vars/vars.hpp"

namespace millrace::tools::commands::vars {
namespace {

TEST(TheJsonOfAValue, IsJsonAlsoWhereTheValueIsNoNumber) {
  const double infinite = std::numeric_limits<double>::infinity();
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::string sut = boost::json::serialize(json_of({1.5, infinite, -infinite, none}, true));
  EXPECT_EQ(sut, R"([1.5E0,"inf","-inf","nan"])");
  EXPECT_NO_THROW(boost::json::parse(sut));
}

}  // namespace
}  // namespace millrace::tools::commands::vars
