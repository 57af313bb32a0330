#include <gtest/gtest.h>

#include "fabric/dds/configuration.hpp"

namespace millrace::fabric::dds {
namespace {

TEST(CycloneLog, CountsLinesThatDifferInNumbersAsTheSameFault) {
  EXPECT_EQ(kind_of_line("handshake with 110c0a1:1c1 failed (code: 200)"),
            kind_of_line("handshake with 8f00001:22 failed (code: 201)"));
  EXPECT_NE(kind_of_line("subject: /O=plant/CN=press"), kind_of_line("subject: /O=plant/CN=lathe"));
}

TEST(CycloneLog, AcceptsAnyLine) {
  EXPECT_EQ(kind_of_line(""), "");
  EXPECT_EQ(kind_of_line(" a  1"), kind_of_line(" a  2"));
}

}  // namespace
}  // namespace millrace::fabric::dds
