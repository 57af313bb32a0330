#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"
#include "cnc/ads/sum_codec.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

constexpr Index read_by_name{0x122301, 0x48};
constexpr Index write_by_name{0x122301, 0x4A};

Bytes request_vector(const std::string& name) {
  return tests::hex_vector("ads/requests.hex", name);
}

template <typename T>
T decode(Command command, const Bytes& payload) {
  const auto request = decode_request(command, payload);
  if (!request) {
    ADD_FAILURE() << describe(request.error());
    return {};
  }
  return std::get<T>(*request);
}

ErrorCode error_of(Command command, const Bytes& payload) {
  const auto request = decode_request(command, payload);
  return request ? ErrorCode::none : request.error();
}

TEST(AdsRequest, Read) {
  const auto payload = request_vector("read");
  const auto sut = decode<ReadRequest>(Command::read, payload);
  EXPECT_EQ(sut.index, read_by_name);
  EXPECT_EQ(sut.length, 0xFFFFFFFFU);
  EXPECT_EQ(encode(sut), payload);
}

TEST(AdsRequest, Write) {
  const auto payload = request_vector("write");
  const auto sut = decode<WriteRequest>(Command::write, payload);
  EXPECT_EQ(sut.index, write_by_name);
  EXPECT_THAT(sut.data, ElementsAre(0x0A, 0x0B, 0x0C));
  EXPECT_EQ(encode(sut), payload);
}

TEST(AdsRequest, WriteControl) {
  const auto payload = request_vector("write_control");
  const auto sut = decode<WriteControlRequest>(Command::write_control, payload);
  EXPECT_EQ(sut.wanted.ads, 5);
  EXPECT_EQ(sut.wanted.device, 1);
  EXPECT_THAT(sut.data, ElementsAre(0xAA, 0xBB));
}

TEST(AdsRequest, ReadWrite) {
  const auto payload = request_vector("read_write");
  const auto sut = decode<ReadWriteRequest>(Command::read_write, payload);
  EXPECT_EQ(sut.index, read_by_name);
  EXPECT_EQ(sut.read_length, 128U);
  EXPECT_THAT(sut.data, ElementsAre('V', '.', 'X', 0));
  EXPECT_EQ(encode(sut), payload);
}

TEST(AdsRequest, AddNotification) {
  const auto payload = request_vector("add_notification");
  const auto sut = decode<AddNotificationRequest>(Command::add_notification, payload);
  EXPECT_EQ(sut.index, (Index{0xF005, 0x11}));
  EXPECT_EQ(sut.length, 4U);
  EXPECT_EQ(sut.mode, Transmission::on_change);
  EXPECT_EQ(sut.max_delay, 1'000'000U);
  EXPECT_EQ(sut.cycle, 10'000'000U);
  EXPECT_EQ(encode(sut), payload);
}

TEST(AdsRequest, DeleteNotification) {
  const auto payload = request_vector("delete_notification");
  const auto sut = decode<DeleteNotificationRequest>(Command::delete_notification, payload);
  EXPECT_EQ(sut.handle, 42U);
  EXPECT_EQ(encode(sut), payload);
}

TEST(AdsRequest, ForInfoAndStateIsEmpty) {
  decode<InfoRequest>(Command::read_device_info, {});
  decode<StateRequest>(Command::read_state, {});
  EXPECT_EQ(error_of(Command::read_state, {0}), ErrorCode::invalid_size);
}

TEST(AdsRequest, WhoseLengthsDoNotFitIsOfInvalidSize) {
  EXPECT_EQ(error_of(Command::read, request_vector("read_cut_short")), ErrorCode::invalid_size);
  EXPECT_EQ(error_of(Command::write, request_vector("write_longer_than_its_data")),
            ErrorCode::invalid_size);
  EXPECT_EQ(error_of(Command::write, request_vector("write_shorter_than_its_data")),
            ErrorCode::invalid_size);
}

TEST(AdsRequest, OfAnUnknownCommandIsNotSupported) {
  EXPECT_EQ(error_of(Command{0}, {}), ErrorCode::service_not_supported);
  EXPECT_EQ(error_of(Command::notification, {}), ErrorCode::service_not_supported);
  EXPECT_EQ(error_of(Command{0x1234}, {}), ErrorCode::service_not_supported);
}

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

const std::vector<SumItem> two_items{{{1, 1}, 8, {1, 2, 3}}, {{9, 9}, 4, {}}};

Bytes answer() {
  auto payload = tests::hex_vector("ads/sums.hex", "read_write_answer");
  payload.erase(payload.begin(), payload.begin() + 8);
  return payload;
}

TEST(SumOfReadWrites, HasAllItemsBeforeAllData) {
  auto expected = tests::hex_vector("ads/sums.hex", "read_write");
  expected.erase(expected.begin(), expected.begin() + 16);
  expected[8] = 8;  // the vector requests 0xFFFFFFFF bytes
  expected[9] = expected[10] = expected[11] = 0;
  EXPECT_EQ(encode_sum(two_items), expected);
  EXPECT_EQ(sum_length(two_items), 28U);
}

TEST(SumOfReadWrites, GivesEachItemItsOwnResult) {
  const auto sut = decode_sum(answer(), two_items);
  ASSERT_TRUE(sut);
  ASSERT_THAT(*sut, SizeIs(2));
  EXPECT_THAT(*(*sut)[0], ElementsAre(0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88));
  EXPECT_EQ((*sut)[1].error(), ErrorCode::invalid_group);
}

TEST(SumOfReadWrites, BreaksTheProtocolWithLengthsThatDoNotFit) {
  auto cut = answer();
  cut.pop_back();
  EXPECT_EQ(decode_sum(cut, two_items).error(), ErrorCode::protocol_error);
  auto too_long = answer();
  too_long[4] = 9;
  too_long.push_back(0);
  EXPECT_EQ(decode_sum(too_long, two_items).error(), ErrorCode::protocol_error);
  EXPECT_EQ(decode_sum({}, two_items).error(), ErrorCode::protocol_error);
}

TEST(SumOfReadWrites, IsUnderstoodByADevice) {
  MemoryDevice memory;
  memory.values[{1, 1}] = {0xAA};
  SumCommands device(memory);
  const auto bytes =
      device.read_write(552, {sum::read_write, 2}, sum_length(two_items), encode_sum(two_items));
  const auto sut = decode_sum(*bytes, two_items);
  EXPECT_THAT(*sut->at(0), ElementsAre(0xAA));
  EXPECT_THAT(memory.values[(Index{1, 1})], ElementsAre(1, 2, 3));
}

}  // namespace
}  // namespace millrace::cnc::ads
