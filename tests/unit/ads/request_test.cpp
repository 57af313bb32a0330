#include "cnc/ads/request.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;

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
  EXPECT_EQ(encode(sut), payload);
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

}  // namespace
}  // namespace millrace::cnc::ads
