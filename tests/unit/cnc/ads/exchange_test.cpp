#include "cnc/ads/exchange.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;

const Address us{{{127, 0, 0, 1, 2, 1}}, 32750};
const Address controller{{{127, 0, 0, 1, 1, 1}}, 552};
constexpr Exchange::Id first_id = 100;

Exchange make(std::size_t window = 8) {
  return {us, controller.net_id, window, first_id};
}

std::vector<Header> headers_in(const Bytes& frames) {
  std::vector<Header> headers;
  FrameReader reader(10'000);
  reader.feed(frames);
  for (auto frame = reader.next(); *frame; frame = reader.next()) {
    headers.push_back(decode_packet((*frame)->body)->header);
  }
  return headers;
}

Header response(Exchange::Id id, Command command = Command::read) {
  return {us, controller, command, flags::ads_command | flags::response, ErrorCode::none, id};
}

Header request_to_us(Command command, Exchange::Id id = 1) {
  const Address from{controller.net_id, 10000};
  return {us, from, command, flags::ads_command, ErrorCode::none, id};
}

const Bytes good = encode_data(Bytes{1});

TEST(Exchange, SendsARequestToTheTargetFromOurAddress) {
  auto sut = make();
  const auto id = sut.begin(552, Command::read, Bytes{1, 2, 3});
  EXPECT_EQ(id, first_id);
  EXPECT_THAT(
      headers_in(sut.take_output()),
      ElementsAre(Header{controller, us, Command::read, flags::ads_command, ErrorCode::none, id}));
  EXPECT_THAT(sut.take_output(), IsEmpty());
}

TEST(Exchange, CompletesARequestOnceWithItsPayload) {
  auto sut = make();
  const auto id = sut.begin(552, Command::read, {});
  const auto done = sut.receive({response(id), good});
  ASSERT_TRUE(done);
  EXPECT_EQ(done->id, id);
  EXPECT_EQ(*done->response, good);
  EXPECT_FALSE(sut.receive({response(id), good}));
  EXPECT_EQ(sut.counters().late, 1U);
}

TEST(Exchange, CompletesARequestWithTheErrorOfItsAmsHeader) {
  auto sut = make();
  auto header = response(sut.begin(552, Command::read, {}));
  header.error = ErrorCode::target_port_not_found;
  EXPECT_EQ(sut.receive({header, {}})->response.error(), ErrorCode::target_port_not_found);
}

TEST(Exchange, MatchesCommandPeerAndOurAddressBesideTheId) {
  auto sut = make();
  const auto id = sut.begin(552, Command::read, {});
  auto other_command = response(id, Command::write);
  auto other_port = response(id);
  other_port.source.port = 553;
  auto other_machine = response(id);
  other_machine.source.net_id = us.net_id;
  auto for_another = response(id);
  for_another.target.port = 1;
  for (const auto& header : {other_command, other_port, other_machine, for_another}) {
    EXPECT_FALSE(sut.receive({header, good}));
  }
  EXPECT_EQ(sut.counters().foreign, 4U);
  EXPECT_TRUE(sut.receive({response(id), good}));
}

TEST(Exchange, KeepsTheWindowAndTheOrder) {
  auto sut = make(2);
  const auto a = sut.begin(552, Command::read, {});
  const auto b = sut.begin(552, Command::read, {});
  const auto c = sut.begin(552, Command::write, {});
  EXPECT_THAT(headers_in(sut.take_output()), SizeIs(2));
  EXPECT_FALSE(sut.receive({response(c, Command::write), good})) << "it is not on the wire yet";
  sut.receive({response(b), good});
  EXPECT_EQ(headers_in(sut.take_output()).at(0).invoke_id, c);
  sut.receive({response(a), good});
  EXPECT_THAT(sut.take_output(), IsEmpty());
}

TEST(Exchange, AnAbandonedRequestMakesRoom) {
  auto sut = make(1);
  const auto a = sut.begin(552, Command::read, {});
  const auto b = sut.begin(552, Command::read, {});
  const auto c = sut.begin(552, Command::read, {});
  static_cast<void>(sut.take_output());
  sut.give_up(b);
  sut.time_out(a);
  EXPECT_EQ(headers_in(sut.take_output()).at(0).invoke_id, c);
  EXPECT_EQ(sut.counters().timeouts, 1U);
}

TEST(Exchange, HalvesTheWindowOnOverloadAndWidensItAgain) {
  auto sut = make(4);
  const auto overload = encode_data(tl::make_unexpected(ErrorCode::router_mailbox_full));
  auto next = sut.begin(552, Command::read, {});
  for (int i = 0; i < 20; ++i) {
    sut.begin(552, Command::read, {});
  }
  EXPECT_THAT(headers_in(sut.take_output()), SizeIs(4));
  sut.receive({response(next++), overload});
  sut.receive({response(next++), good});
  EXPECT_THAT(sut.take_output(), IsEmpty()) << "two on the wire fill the halved window";
  sut.receive({response(next++), good});
  EXPECT_THAT(headers_in(sut.take_output()), SizeIs(2)) << "a full window went well: one more";
}

TEST(Exchange, NamesAllPendingRequestsWhenTheLinkIsLost) {
  auto sut = make(1);
  const auto a = sut.begin(552, Command::read, {});
  const auto b = sut.begin(552, Command::write, {});
  EXPECT_THAT(sut.lose_link(), UnorderedElementsAre(a, b));
  EXPECT_THAT(sut.take_output(), IsEmpty()) << "nothing is repeated on the next link";
  EXPECT_THAT(sut.lose_link(), IsEmpty());
}

TEST(Exchange, SendsAFullWindowAgainOnANewLinkAfterAnOverload) {
  auto sut = make(4);
  const auto id = sut.begin(552, Command::read, {});
  sut.receive({response(id), encode_data(tl::make_unexpected(ErrorCode::router_mailbox_full))});
  static_cast<void>(sut.lose_link());
  for (int i = 0; i < 10; ++i) {
    sut.begin(552, Command::read, {});
  }
  EXPECT_THAT(headers_in(sut.take_output()), SizeIs(4));
}

TEST(Exchange, AnswersAStateRequestOfTheController) {
  auto sut = make();
  EXPECT_FALSE(sut.receive({request_to_us(Command::read_state), {}}));
  const auto answers = headers_in(sut.take_output());
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_TRUE(answers[0].is_response());
  EXPECT_EQ(answers[0].error, ErrorCode::none);
  EXPECT_EQ(answers[0].target.port, 10000);
}

TEST(Exchange, AnswersOtherRequestsWithError6) {
  auto sut = make();
  sut.receive({request_to_us(Command::read), {}});
  EXPECT_EQ(headers_in(sut.take_output()).at(0).error, ErrorCode::target_port_not_found);
}

TEST(Exchange, DropsMirroredFramesNotificationsAndFramesForOthers) {
  auto sut = make();
  const Header mirrored{controller, us, Command::read, flags::ads_command, ErrorCode::none, 100};
  auto for_another = request_to_us(Command::read_state);
  for_another.target.net_id = controller.net_id;
  auto wants_no_answer = request_to_us(Command::read_state);
  wants_no_answer.flags |= flags::no_return;
  for (const auto& header :
       {mirrored, for_another, wants_no_answer, request_to_us(Command::notification)}) {
    EXPECT_FALSE(sut.receive({header, {}}));
  }
  EXPECT_THAT(sut.take_output(), IsEmpty());
  EXPECT_EQ(sut.counters().foreign, 4U);
}

TEST(Exchange, CountsEachResponseOfTheControllerOnceInTimeOrLate) {
  auto sut = make();
  const auto in_time = sut.begin(552, Command::read, {});
  const auto late = sut.begin(552, Command::read, {});
  sut.time_out(late);
  EXPECT_EQ(sut.answers(), 0U);
  sut.receive({response(in_time), good});
  EXPECT_EQ(sut.answers(), 1U);
  sut.receive({response(late), good});
  EXPECT_EQ(sut.answers(), 2U);
  sut.receive({response(late), good});
  EXPECT_EQ(sut.answers(), 2U);
}

TEST(Exchange, TakesNoOtherFrameForAnAnswer) {
  auto sut = make();
  const auto pending = sut.begin(552, Command::read, {});
  const auto late = sut.begin(552, Command::read, {});
  sut.time_out(late);
  const auto not_sent = static_cast<Exchange::Id>(late + 1);
  std::vector<Header> frames{request_to_us(Command::read_state), request_to_us(Command::read),
                             response(not_sent), response(first_id - 1)};
  for (const auto id : {pending, late}) {
    // Our own frame, sent back as it was or as a response.
    frames.push_back({controller, us, Command::read, flags::ads_command, ErrorCode::none, id});
    frames.push_back(
        {controller, us, Command::read, flags::ads_command | flags::response, ErrorCode::none, id});
    frames.push_back(response(id, Command::write));
    frames.push_back(response(id));
    frames.back().source.port = 10000;
    frames.push_back(response(id));
    frames.back().source.net_id = us.net_id;
    frames.push_back(response(id));
    frames.back().target.port = 1;
  }
  for (const Header& header : frames) {
    EXPECT_FALSE(sut.receive({header, good}));
  }
  const Address state_port{controller.net_id, 552};
  EXPECT_TRUE(sut.notifies(
      {{us, state_port, Command::notification, flags::ads_command, ErrorCode::none, 0}, good}));
  sut.receive_router_frame();
  EXPECT_EQ(sut.answers(), 0U);
}

TEST(Exchange, TakesAnErrorOfTheRouterForNoAnswerOfTheController) {
  auto sut = make();
  for (const auto code : {0x4U, 0x6U, 0x7U, 0xDU, 0x12U, 0x1AU, 0x1BU, 0x1DU, 0x502U, 0x507U}) {
    auto in_time = response(sut.begin(552, Command::read, {}));
    auto late = response(sut.begin(552, Command::read, {}));
    sut.time_out(late.invoke_id);
    in_time.error = late.error = ErrorCode{code};
    EXPECT_EQ(sut.receive({in_time, {}})->response.error(), ErrorCode{code});
    EXPECT_FALSE(sut.receive({late, {}}));
    EXPECT_EQ(sut.answers(), 0U) << describe(ErrorCode{code});
  }
  auto refused = response(sut.begin(552, Command::read, {}));
  refused.error = ErrorCode::service_not_supported;
  EXPECT_TRUE(sut.receive({refused, {}}));
  sut.begin(552, Command::read, {});
  sut.receive({response(refused.invoke_id + 1),
               encode_data(tl::make_unexpected(ErrorCode::target_port_not_found))});
  EXPECT_EQ(sut.answers(), 2U) << "errors of a device, whatever it could not reach itself";
}

TEST(Exchange, TakesNoResponseToAnEarlierConnectionForAnAnswer) {
  auto sut = make();
  const auto late = sut.begin(552, Command::read, {});
  sut.time_out(late);
  static_cast<void>(sut.lose_link());
  sut.receive({response(late), good});
  EXPECT_EQ(sut.answers(), 0U);
}

}  // namespace
}  // namespace millrace::cnc::ads
