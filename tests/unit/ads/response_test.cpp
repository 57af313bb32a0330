#include "cnc/ads/response.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

Bytes response_vector(const std::string& name) {
  return tests::hex_vector("ads/responses.hex", name);
}

template <typename T>
ErrorCode error_of(const Result<T>& result) {
  return result ? ErrorCode::none : result.error();
}

TEST(AdsResponse, ToAWriteIsTheResultAlone) {
  EXPECT_TRUE(decode_result(response_vector("result_none")));
  EXPECT_EQ(error_of(decode_result(response_vector("result_busy"))), ErrorCode::busy);
  EXPECT_EQ(encode_result({}), response_vector("result_none"));
  EXPECT_EQ(encode_result(tl::make_unexpected(ErrorCode::busy)), response_vector("result_busy"));
}

TEST(AdsResponse, ToAReadCarriesData) {
  const auto payload = response_vector("data");
  const auto sut = decode_data(payload, 4);
  ASSERT_TRUE(sut);
  EXPECT_THAT(*sut, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(encode_data(Bytes{1, 2, 3, 4}), payload);
}

TEST(AdsResponse, ToAReadMayBeShorterThanRequested) {
  EXPECT_THAT(*decode_data(response_vector("data"), 8), SizeIs(4));
}

TEST(AdsResponse, LongerThanRequestedBreaksTheProtocol) {
  EXPECT_EQ(error_of(decode_data(response_vector("data"), 3)), ErrorCode::protocol_error);
}

TEST(AdsResponse, WithAWrongLengthBreaksTheProtocol) {
  EXPECT_EQ(error_of(decode_data(response_vector("data_that_lies"), 240)),
            ErrorCode::protocol_error);
}

TEST(AdsResponse, ToAFailedReadIsSentAs8Bytes) {
  EXPECT_EQ(encode_data(tl::make_unexpected(ErrorCode::invalid_group)),
            response_vector("data_error"));
}

TEST(AdsResponse, ToAFailedReadIsUnderstoodWith4Or8Bytes) {
  EXPECT_EQ(error_of(decode_data(response_vector("data_error"), 4)), ErrorCode::invalid_group);
  EXPECT_EQ(error_of(decode_data(response_vector("data_error_of_4_bytes"), 4)),
            ErrorCode::invalid_group);
}

TEST(AdsResponse, CannotHaveALocalErrorCode) {
  EXPECT_EQ(error_of(decode_data(response_vector("local_code_on_the_wire"), 4)),
            ErrorCode::protocol_error);
}

TEST(AdsResponse, WithoutResultBreaksTheProtocol) {
  EXPECT_EQ(error_of(decode_result({})), ErrorCode::protocol_error);
  EXPECT_EQ(error_of(decode_state(response_vector("result_none"))), ErrorCode::protocol_error);
  EXPECT_EQ(error_of(decode_info(response_vector("result_none"))), ErrorCode::protocol_error);
  EXPECT_EQ(error_of(decode_handle(response_vector("result_none"))), ErrorCode::protocol_error);
}

TEST(AdsResponse, NamesTheDeviceIn16Bytes) {
  const auto payload = response_vector("info");
  const auto sut = decode_info(payload);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->major, 3);
  EXPECT_EQ(sut->minor, 1);
  EXPECT_EQ(sut->build, 3896);
  EXPECT_EQ(sut->name, "millrace CNC");
  EXPECT_EQ(encode_info(*sut), payload);
  EXPECT_THAT(encode_info(DeviceInfo{1, 2, 3, "a name of 21 letters."}), SizeIs(24));
}

TEST(AdsResponse, CarriesTheState) {
  const auto payload = response_vector("state");
  const auto sut = decode_state(payload);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->ads, 5);
  EXPECT_EQ(sut->device, 0);
  EXPECT_EQ(encode_state(*sut), payload);
}

TEST(AdsResponse, CarriesANotificationHandle) {
  EXPECT_EQ(*decode_handle(response_vector("handle")), 42U);
  EXPECT_EQ(encode_handle(42U), response_vector("handle"));
}

TEST(Notification, CarriesSamplesOfOneMoment) {
  const auto payload = response_vector("notification");
  const auto sut = decode_notification(payload);
  ASSERT_TRUE(sut);
  ASSERT_THAT(*sut, SizeIs(1));
  EXPECT_EQ((*sut)[0].time, 116'444'736'000'000'000U);
  ASSERT_THAT((*sut)[0].samples, SizeIs(2));
  EXPECT_EQ((*sut)[0].samples[0].handle, 1U);
  EXPECT_THAT((*sut)[0].samples[0].data, ElementsAre(0x11, 0x22, 0x33, 0x44));
  EXPECT_THAT((*sut)[0].samples[1].data, ElementsAre(0x55));
  EXPECT_EQ(encode_notification(*sut), payload);
}

TEST(Notification, WithAWrongCountBreaksTheProtocol) {
  EXPECT_EQ(error_of(decode_notification(response_vector("notification_with_too_many_samples"))),
            ErrorCode::protocol_error);
  EXPECT_EQ(error_of(decode_notification({})), ErrorCode::protocol_error);
}

}  // namespace
}  // namespace millrace::cnc::ads
