#include "cnc/simulator/configuration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/command_line.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"

namespace millrace::cnc::simulator {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const std::filesystem::path good = tests::test_data("config/good");

TEST(Configuration, ChangesNothingUndocumentedByDefault) {
  const Settings sut = parse_settings("", "empty");
  EXPECT_EQ(sut.channels, 1);
  EXPECT_FALSE(sut.service.response_clears_request);
  EXPECT_FALSE(sut.service.ads_request_clears_response);
  EXPECT_FALSE(sut.service.reset_clears_states);
  EXPECT_TRUE(sut.answers.whole_string_buffer);
  EXPECT_EQ(sut.answers.unknown_variable, ads::ErrorCode::symbol_not_found);
}

TEST(Configuration, ReadsSecureAds) {
  const auto sut = read_settings(good / "every_switch.cnc.textproto").secure_ads;
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->listen.host, "127.0.0.2");
  EXPECT_EQ(sut->listen.port, 8017);
  EXPECT_EQ(sut->security.psk, (ads::Psk{"millrace", "secret"}));
  EXPECT_EQ(sut->security.self_signed->user, "Administrator");
  EXPECT_EQ(sut->routes_file, good / "routes");
  EXPECT_TRUE(sut->only);
  EXPECT_EQ(sut->faults.handshake_delay, std::chrono::milliseconds(10));
  EXPECT_TRUE(sut->faults.close_after_handshake);
  EXPECT_EQ(sut->faults.answer, ads::ConnectError::unknown_certificate);
  EXPECT_TRUE(sut->faults.garbage);
  EXPECT_EQ(sut->faults.missing_bytes, 4);
  EXPECT_EQ(sut->faults.least_pause, std::chrono::milliseconds(500));
  EXPECT_FALSE(parse_settings("", "empty").secure_ads);
}

TEST(Configuration, ReadsDiscovery) {
  const auto sut = read_settings(good / "every_switch.cnc.textproto").discovery;
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->listen.port, 48890);
  EXPECT_EQ(sut->name, "press");
  EXPECT_EQ(sut->user, "Administrator");
  EXPECT_EQ(sut->password, "1");
}

TEST(Configuration, ReadsEverySwitch) {
  const Settings sut = read_settings(good / "every_switch.cnc.textproto");
  EXPECT_EQ(sut.channels, 3);
  EXPECT_TRUE(sut.service.response_clears_request);
  EXPECT_TRUE(sut.service.ads_request_clears_response);
  EXPECT_TRUE(sut.service.reset_clears_states);
  EXPECT_FALSE(sut.answers.whole_string_buffer);
  EXPECT_EQ(sut.answers.unknown_variable, ads::ErrorCode::invalid_data);
  EXPECT_FALSE(sut.answers.old_groups);
  EXPECT_EQ(sut.answers.old_value_offset, 92);
  EXPECT_TRUE(sut.service.start_clears_states);
  EXPECT_EQ(sut.service.writes_visible_after, std::chrono::milliseconds(10));
  EXPECT_EQ(sut.service.kernel_clears_after, std::chrono::milliseconds(0));
  EXPECT_THAT(sut.folders, ElementsAre(good / "cycles", "/opt/nc"));
}

TEST(Configuration, ReadsTheAxesOfChannels) {
  const Settings sut = read_settings(good / "every_switch.cnc.textproto");
  EXPECT_EQ(sut.cycle, std::chrono::milliseconds(2));
  EXPECT_EQ(sut.program.rapid_feed, 24000);
  ASSERT_EQ(sut.axes_of(1).size(), 2);
  EXPECT_EQ(sut.axes_of(1)[0].name, "X");
  EXPECT_EQ(sut.axes_of(1)[0].negative_limit, -10);
  EXPECT_EQ(sut.axes_of(1)[0].positive_limit, 500.5);
  EXPECT_EQ(sut.axes_of(1)[0].greatest_feed, 3000);
  ASSERT_EQ(sut.axes_of(3).size(), 1);
  EXPECT_EQ(sut.axes_of(3)[0].name, "W");
}

TEST(Configuration, ReadsSystemData) {
  const Settings sut = read_settings(good / "every_switch.cnc.textproto");
  ASSERT_EQ(sut.system_data.size(), 3);
  EXPECT_EQ(sut.system_data[0].elements, 100);
  EXPECT_EQ(sut.system_data[0].element_size(), 128);
  EXPECT_TRUE(sut.system_data[1].structure());
  EXPECT_EQ(sut.system_data[1].size(), 6);
  EXPECT_EQ(sut.system_data[2].value, nc::Value(2.5));
}

TEST(Configuration, LaysOutExternalVariablesInTheirScope) {
  const Settings sut = read_settings(good / "every_switch.cnc.textproto");
  ASSERT_EQ(sut.externals.size(), 3);
  const Declaration& part = sut.externals[0];
  EXPECT_EQ(part.name, "V.E.PART");
  EXPECT_EQ(part.element.type, Type::string);
  EXPECT_EQ(part.size(), 128);
  EXPECT_EQ(part.access, Access::read_only);
  EXPECT_TRUE(part.external->global);
  EXPECT_FALSE(part.external->synchronised);
  EXPECT_EQ(part.external->address, 0);
  const Declaration& table = sut.externals[1];
  EXPECT_EQ(table.size(), 80);
  EXPECT_EQ(table.external->address, 0);
  EXPECT_TRUE(table.external->synchronised);
  EXPECT_EQ(sut.externals[2].external->address, 80);
  EXPECT_EQ(sut.externals[2].element.type, Type::uns32);
}

TEST(Configuration, ReadsTheVariablesThatAreAdded) {
  const Settings sut = read_settings(good / "every_switch.cnc.textproto");
  ASSERT_EQ(sut.variables.size(), 3);
  const SystemVariable& offsets = sut.variables[0];
  EXPECT_EQ(offsets.declaration.name, "V.G.NP.V");
  EXPECT_EQ(offsets.declaration.listed(), "V.G.NP[98].V");
  EXPECT_TRUE(offsets.per_axis);
  EXPECT_EQ(offsets.declaration.access, Access::read_write);
  EXPECT_EQ(sut.variables[1].declaration.access, Access::read_only);
  EXPECT_EQ(sut.variables[1].value, nc::Value{12.5});
  EXPECT_EQ(sut.variables[2].declaration.size(), 21);
  EXPECT_EQ(sut.variables[2].value, nc::Value{std::string("drill")});
  EXPECT_THAT(sut.aep_parameters, ElementsAre(testing::Pair("TEMPERATURE", 21.5)));
}

TEST(Configuration, ReadsHowProgramsAreExecuted) {
  const nc::ChannelOptions sut = read_settings(good / "every_switch.cnc.textproto").program;
  EXPECT_EQ(sut.queue, 5);
  EXPECT_FALSE(sut.withhold_last_motion);
  EXPECT_TRUE(sut.flush_continue_waits);
  EXPECT_FALSE(sut.messages_read_at_once);
  EXPECT_TRUE(sut.optional_stop);
  EXPECT_EQ(sut.skipped_levels, 0b10'0000'0001);
  EXPECT_EQ(sut.stream_program, "stream.nc");
}

TEST(Configuration, ReadsHowConnectionsBehave) {
  const ConnectionSettings sut = read_settings(good / "every_switch.cnc.textproto").connections;
  EXPECT_EQ(sut.foreign_target, ads::ForeignTarget::close);
  EXPECT_THAT(sut.routes, ElementsAre(ads::NetId{{127, 0, 0, 1, 2, 1}}));
  EXPECT_TRUE(sut.one_per_address);
  EXPECT_FALSE(sut.sum_commands);
  EXPECT_FALSE(sut.symbols);
  EXPECT_TRUE(sut.notifications_survive);
  EXPECT_EQ(sut.faults.delay, std::chrono::milliseconds(5));
  EXPECT_EQ(sut.faults.drop_every, 10);
  EXPECT_TRUE(sut.faults.out_of_order);
  EXPECT_EQ(sut.faults.segment, 7);
  EXPECT_TRUE(sut.faults.refuse_connections);
  EXPECT_FALSE(sut.variable_symbols);
  EXPECT_EQ(sut.max_notifications, 8);
  EXPECT_EQ(sut.notifications.by_handle, ads::ErrorCode::no_more_handles);
  EXPECT_EQ(sut.notifications.tells, ads::SubscriptionBehaviour::Notifies::first_value);
  EXPECT_EQ(sut.notifications.delay, std::chrono::milliseconds(20));
  EXPECT_EQ(sut.notifications.lose_every, 3);
}

/// An invalid configuration, and its error message.
struct Mistake {
  const char* text;
  const char* message;
};

class MistakenConfiguration : public testing::TestWithParam<Mistake> {};

TEST_P(MistakenConfiguration, IsRefusedWithAReason) {
  EXPECT_THAT([] { parse_settings(GetParam().text, "x"); },
              ThrowsMessage<base::program::UsageError>(HasSubstr(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(
    Each, MistakenConfiguration,
    testing::Values(
        Mistake{"channels: 0", "x:1:1: channels: 0; expected 1 to 255"},
        Mistake{"channels: 256", "x:1:1: channels: 256; expected 1 to 255"},
        Mistake{"\nchanels: 2", "x:2:8: "},
        Mistake{"cycle_us: 249", "x:1:1: cycle_us: 249; expected 250 to 100000"},
        Mistake{"rapid_feed: nan", "x:1:1: rapid_feed: nan; expected 1 to 1000000"},
        Mistake{"programs { look_ahead: 0 }",
                "x:1:12: programs.look_ahead: 0; expected 1 to 10000"},
        Mistake{"programs { skipped_level: 11 }", "skipped_level: 11; expected 1 to 10"},
        Mistake{"connections { route: \"1.2.3\" }",
                "x:1:15: connections.route: \"1.2.3\"; expected six"},
        Mistake{"faults { delay_ms: 60001 }", "delay_ms: 60001; expected 0 to 60000"},
        Mistake{"answers { old_value_offset: 93 }", "old_value_offset: 93; expected 92 or 96"},
        Mistake{"axis { name: \"X\" greatest_feed: -1 }",
                "x:1:18: axis.greatest_feed: -1; expected 0 to 1000000"},
        Mistake{"axis {}", "x:1:1: axis.name: is missing; expected name: \"X\""},
        Mistake{"axis { name: \"x\" }", "x:1:8: axis.name: \"x\"; expected a capital letter"},
        Mistake{"axis { name: \"X Y\" }",
                "x:1:8: axis.name: \"X Y\"; expected 1 or more letters, digits"},
        Mistake{"axis { name: \"X\" negative_limit: 1 positive_limit: 1 }",
                "x:1:18: axis.negative_limit: of axis X is not below positive_limit"},
        Mistake{"channel { number: 2 }", "x:1:11: channel.number: 2; expected 1 to 1"},
        Mistake{"channel { axis { name: \"X\" } }",
                "x:1:1: channel.number: is missing; expected 1 to 255"},
        Mistake{"channel { number: 1 } channel { number: 1 }",
                "x:1:33: channel.number: 1 occurs twice"},
        Mistake{"external_variable {}",
                "x:1:1: external_variable.name: is missing; expected 1 to 20"},
        Mistake{"external_variable { name: \"A[1]\" }",
                "name: \"A[1]\"; expected a name without brackets"},
        Mistake{"external_variable { name: \"A\" } external_variable { name: \"A\" }",
                "x:1:53: external_variable.name: \"A\" occurs twice"},
        Mistake{"external_variable { name: \"A\" characters: 128 }",
                "characters: 128; expected 1 to 127"},
        Mistake{"external_variable { name: \"A\" array_elements: 10001 }",
                "array_elements: 10001; expected 0 to 10000"}),
    [](const auto& mistake) { return "Case" + std::to_string(mistake.index); });

TEST(Configuration, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("cnc", [](const auto& file) -> std::string {
    try {
      read_settings(file);
      return "no error";
    } catch (const base::program::UsageError& error) {
      return error.what();
    }
  });
}

}  // namespace
}  // namespace millrace::cnc::simulator
