#include "cnc/ads/error.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::ads {
namespace {

TEST(AdsError, HasItsNumberAndItsText) {
  EXPECT_EQ(describe(ErrorCode::symbol_not_found), "0x710 symbol not found");
  EXPECT_EQ(describe(ErrorCode{0x274D}), "0x274d TCP: connection refused");
}

TEST(AdsError, WithoutATextHasItsNumber) {
  EXPECT_EQ(describe(ErrorCode{0x7FF}), "ADS error 0x7ff");
  EXPECT_EQ(describe(ErrorCode{0xFFFE0000}), "ADS error 0xfffe0000");
}

TEST(AdsError, OfOurOwnHasItsTextOnly) {
  EXPECT_EQ(describe(ErrorCode::link_down), "not connected to the controller");
}

TEST(AdsError, OfOurOwnCannotComeFromTheWire) {
  EXPECT_EQ(from_wire(0xFFFF0001), ErrorCode::protocol_error);
  EXPECT_EQ(from_wire(0x745), ErrorCode::timeout);
}

TEST(AdsError, LeavesTheOutcomeOfAWriteUnknownUnlessTheControllerRefusedIt) {
  for (const auto code : {ErrorCode::timeout, ErrorCode::link_lost, ErrorCode::cancelled,
                          ErrorCode::device_timeout, ErrorCode::protocol_error}) {
    EXPECT_TRUE(leaves_outcome_unknown(code)) << describe(code);
    EXPECT_FALSE(is_refusal(code)) << describe(code);
  }
  for (const auto code : {ErrorCode::invalid_size, ErrorCode::symbol_not_found}) {
    EXPECT_FALSE(leaves_outcome_unknown(code)) << describe(code);
    EXPECT_TRUE(is_refusal(code)) << describe(code);
  }
  EXPECT_FALSE(leaves_outcome_unknown(ErrorCode::link_down)) << "nothing was sent";
  EXPECT_FALSE(leaves_outcome_unknown(ErrorCode::busy));
}

}  // namespace
}  // namespace millrace::cnc::ads
