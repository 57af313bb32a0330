// A message queue behind the ADS symbols of a virtual CNC.
#include "gateway/shell/ads_message_queue.hpp"

#include <algorithm>
#include <map>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/log.hpp"
#include "cnc/ads/device.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/symbol_names.hpp"
#include "cnc/simulator/virtual_device.hpp"
#include "cnc/variables/value.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::gateway {
namespace {

using cnc::simulator::DataDeclaration;
using cnc::simulator::ElementType;
using cnc::simulator::Type;
using testing::ElementsAre;
using testing::HasSubstr;

class NoPrograms final : public cnc::simulator::ProgramSource {
 public:
  tl::expected<cnc::simulator::Program, std::string> load(std::string_view) override {
    return tl::unexpected(std::string("there is none"));
  }
};

/// A controller with false descriptions of symbols.
class MisdescribingDevice final : public cnc::ads::ForwardingDevice {
 public:
  explicit MisdescribingDevice(Device& honest) : ForwardingDevice(honest) {}

  /// One of the five numbers at the beginning of a symbol's entry, 0 to 4: its length, index group,
  /// index offset, size and type.
  struct FalseNumber {
    std::size_t number;
    std::uint32_t value;
  };
  std::map<std::string, FalseNumber> false_numbers;

  cnc::ads::Result<cnc::ads::Bytes> read_write(std::uint16_t port, cnc::ads::Index index,
                                               std::uint32_t read_length,
                                               cnc::ads::BytesView data) override {
    auto entry = ForwardingDevice::read_write(port, index, read_length, data);
    const auto false_number = false_numbers.find(cnc::variables::decode_text(data));
    if (entry && index.group == cnc::ads::symbol::info_by_name &&
        false_number != false_numbers.end()) {
      const auto number = cnc::ads::ByteWriter().u32(false_number->second.value).take();
      std::ranges::copy(number, entry->begin() + static_cast<std::ptrdiff_t>(
                                                     false_number->second.number * number.size()));
    }
    return entry;
  }
};

class AdsMessageQueueTest : public testing::Test {
 protected:
  static DataDeclaration structure(const std::string& name, ElementType members) {
    return {name, {{"LastFilled", members}, {"LastGet", members}}};
  }
  static DataDeclaration array(const std::string& name, ElementType element,
                               std::uint32_t elements) {
    DataDeclaration declaration{name, {{"", element}}, elements};
    declaration.value = cnc::simulator::zero_of(element);
    return declaration;
  }

  void serve(std::vector<DataDeclaration> data) {
    cnc::simulator::Settings settings;
    settings.system_data = std::move(data);
    machine.emplace(
        settings, cnc::simulator::Surroundings{.clock = [] { return std::chrono::nanoseconds(0); },
                                               .programs = programs});
    device.emplace(*machine);
    names.emplace(*machine, device->catalogue());
    symbols.emplace(*device, *names);
    cnc::ads::ServerOptions options;
    options.tcp_port = 0;
    false_device.emplace(*symbols);
    server.emplace(io.get_executor(), *false_device, options, base::program::no_log());
    cnc::ads::ClientOptions client_options;
    client_options.tcp_port = server->tcp_port();
    client_options.target = options.session.net_id;
    client = std::make_shared<cnc::ads::Client>(io.get_executor(), client_options);
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
    queues::QueueSettings queue;
    queue.array = "SD.QUEUE";
    queue.control = "SD.CONTROL";
    sut.emplace(*client, queue);
  }
  template <typename T>
  queues::Answer<T> ask(const queues::Step& step) {
    return std::get<queues::Answer<T>>(tests::wait_for(io, sut->ask(step)));
  }
  queues::Answer<queues::Control> read_control() {
    return ask<queues::Control>(queues::ReadControl{});
  }
  queues::Answer<std::vector<std::string>> read_queue() {
    return ask<std::vector<std::string>>(queues::ReadQueue{});
  }
  queues::Answer<void> write_last_get(std::uint32_t element) {
    return ask<void>(queues::WriteLastGet{element});
  }

  boost::asio::io_context io;
  NoPrograms programs;
  std::optional<cnc::simulator::Machine> machine;
  std::optional<cnc::simulator::VirtualDevice> device;
  std::optional<cnc::simulator::objects::SymbolNames> names;
  std::optional<cnc::ads::Symbols> symbols;
  std::optional<MisdescribingDevice> false_device;
  std::optional<cnc::ads::Server> server;
  std::shared_ptr<cnc::ads::Client> client;
  std::optional<shell::AdsMessageQueue> sut;
};

TEST_F(AdsMessageQueueTest, ReadsTheControlStructureAndTheArrayInOneRequestEach) {
  serve({array("QUEUE", ElementType::text(127), 3),
         structure("CONTROL", ElementType::number(Type::sgn32))});
  ASSERT_TRUE(machine->system_data().assign("SD.QUEUE[2]", std::string("one")));
  ASSERT_TRUE(machine->system_data().assign("SD.QUEUE[3]", std::string(127, 'x')));
  ASSERT_TRUE(machine->system_data().assign("SD.CONTROL.LastFilled", 3.0));
  ASSERT_TRUE(machine->system_data().assign("SD.CONTROL.LastGet", 1.0));
  EXPECT_EQ(read_control().value(), (queues::Control{3, 1, 3}));
  const auto before = client->counters().requests;
  EXPECT_EQ(read_control().value(), (queues::Control{3, 1, 3}));
  EXPECT_THAT(read_queue().value(), ElementsAre("", "one", std::string(127, 'x')));
  EXPECT_EQ(client->counters().requests, before + 2);
}

TEST_F(AdsMessageQueueTest, WritesLastGetAndNothingElse) {
  serve({array("QUEUE", ElementType::text(10), 3),
         structure("CONTROL", ElementType::number(Type::uns16))});
  ASSERT_TRUE(machine->system_data().assign("SD.CONTROL.LastFilled", 3.0));
  ASSERT_TRUE(read_control());
  EXPECT_TRUE(write_last_get(2));
  EXPECT_EQ(read_control().value(), (queues::Control{3, 2, 3}));
}

TEST_F(AdsMessageQueueTest, HasNumbersInTheirShortestForm) {
  serve({array("QUEUE", ElementType::number(Type::real64), 3),
         structure("CONTROL", ElementType::number(Type::sgn32))});
  ASSERT_TRUE(machine->system_data().assign("SD.QUEUE[1]", -0.5));
  ASSERT_TRUE(machine->system_data().assign("SD.QUEUE[2]", 7.0));
  ASSERT_TRUE(read_control());
  EXPECT_THAT(read_queue().value(), ElementsAre("-0.5", "7", "0"));
}

TEST_F(AdsMessageQueueTest, NamesAMissingVariable) {
  serve({array("QUEUE", ElementType::text(127), 3)});
  const auto control = read_control();
  ASSERT_FALSE(control);
  EXPECT_THAT(control.error(), HasSubstr("cannot be read: SD.CONTROL: "));
  EXPECT_FALSE(read_queue());
  EXPECT_FALSE(write_last_get(1));
}

TEST_F(AdsMessageQueueTest, RefusesElementsThatARequestCannotHold) {
  DataDeclaration tools{
      "QUEUE", {{"ID", ElementType::number(Type::sgn32)}, {"NAME", ElementType::text(9)}}, 3};
  serve({tools, structure("CONTROL", ElementType::number(Type::sgn32))});
  const auto control = read_control();
  ASSERT_FALSE(control);
  EXPECT_THAT(control.error(), HasSubstr("is of a type that is not a message"));
}

TEST_F(AdsMessageQueueTest, RefusesIndicesThatAreNotWholeNumbers) {
  serve({array("QUEUE", ElementType::text(127), 3),
         structure("CONTROL", ElementType::number(Type::real64))});
  const auto control = read_control();
  ASSERT_FALSE(control);
  EXPECT_THAT(control.error(), HasSubstr("not whole numbers within SD.CONTROL"));
}

TEST_F(AdsMessageQueueTest, RefusesANumberWithMoreBytesThanItsType) {
  serve({array("QUEUE", ElementType::number(Type::sgn32), 4),
         structure("CONTROL", ElementType::number(Type::uns32))});
  for (const char* name : {"SD.QUEUE[1]", "SD.CONTROL.LastFilled", "SD.CONTROL.LastGet"}) {
    false_device->false_numbers = {{name, {.number = 3, .value = 8}}};
    const auto control = read_control();
    ASSERT_FALSE(control) << name;
    EXPECT_THAT(control.error(), HasSubstr(std::string(name) + " a size of 8 bytes; a "));
  }
  false_device->false_numbers.clear();
  EXPECT_TRUE(read_control());
}

TEST_F(AdsMessageQueueTest, RefusesIndicesOutsideTheControlStructure) {
  serve({array("QUEUE", ElementType::text(127), 3),
         structure("CONTROL", ElementType::number(Type::sgn32))});
  // Four more bytes overflow to 0.
  false_device->false_numbers = {{"SD.CONTROL", {.number = 2, .value = 0}},
                                 {"SD.CONTROL.LastFilled", {.number = 2, .value = 0}},
                                 {"SD.CONTROL.LastGet", {.number = 2, .value = 0xFFFFFFFC}}};
  const auto control = read_control();
  ASSERT_FALSE(control);
  EXPECT_THAT(control.error(), HasSubstr("not whole numbers within SD.CONTROL"));
}

TEST_F(AdsMessageQueueTest, IsNotifiedOfChanges) {
  serve({array("QUEUE", ElementType::text(127), 3),
         structure("CONTROL", ElementType::number(Type::sgn32))});
  ASSERT_TRUE(read_control());
  int notifications = 0;
  EXPECT_TRUE(tests::wait_for(io, sut->watch([&] { ++notifications; })));
  ASSERT_TRUE(tests::run_until(io, [&] { return notifications >= 1; }));
  ASSERT_TRUE(machine->system_data().assign("SD.CONTROL.LastFilled", 2.0));
  EXPECT_TRUE(tests::run_until(io, [&] { return notifications >= 2; }));
}

}  // namespace
}  // namespace millrace::gateway
