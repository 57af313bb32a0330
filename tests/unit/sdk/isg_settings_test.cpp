#include "services/sdk/isg_settings.hpp"

#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace millrace::services::sdk {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

tl::expected<IsgSettings, std::string> read(const std::map<std::string, std::string>& variables) {
  const auto environment = [&](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  };
  return read_isg_settings(environment, "/no/such/file");
}

TEST(IsgSettings, HaveDefaults) {
  const auto sut = read({});
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->options.domain, 0U);
  EXPECT_EQ(sut->options.fabric, "millrace");
  EXPECT_TRUE(sut->options.channels.empty());
  EXPECT_EQ(sut->log_level, spdlog::level::info);
}

TEST(IsgSettings, ReadTheEnvironment) {
  const auto sut = read({{"MILLRACE_DOMAIN", "7"},
                         {"MILLRACE_FABRIC", "shop"},
                         {"MILLRACE_CHANNELS", " cnc/1  press/* "},
                         {"MILLRACE_DELIVERY", "at-most-once"},
                         {"MILLRACE_COMPLETION_SIGNAL", "response"},
                         {"MILLRACE_LOG_LEVEL", "debug"}});
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->options.domain, 7U);
  EXPECT_EQ(sut->options.fabric, "shop");
  EXPECT_THAT(sut->options.channels,
              ElementsAre(fabric::ChannelScope{"cnc", 1}, fabric::ChannelScope{"press", 0}));
  EXPECT_EQ(sut->options.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(sut->options.completion_signal, fabric::CompletionSignal::response);
  EXPECT_EQ(sut->log_level, spdlog::level::debug);
}

TEST(IsgSettings, ReadTheFabricFromAFileByDefault) {
  const tests::TemporaryFolder folder;
  const std::string file = (folder.path() / "fabric.textproto").string();
  std::ofstream(file) << "domain: 9 fabric: 'shop'";
  const auto sut = read({{"MILLRACE_FABRIC_CONFIG", file}, {"MILLRACE_DOMAIN", "7"}});
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->options.fabric, "shop");
  EXPECT_EQ(sut->options.domain, 7U);
  EXPECT_THAT(read({{"MILLRACE_FABRIC_CONFIG", "no/such/file"}}).error(),
              HasSubstr("no/such/file"));
}

TEST(IsgSettings, UseTheFileOfTheHostWhereTheEnvironmentNamesNone) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "fabric.textproto";
  std::ofstream(file) << "domain: 9";
  const auto nothing = [](const char*) -> const char* { return nullptr; };
  const auto none = [](const char* name) {
    return std::string_view(name) == "MILLRACE_FABRIC_CONFIG" ? "" : nullptr;
  };
  EXPECT_EQ(read_isg_settings(nothing, file)->options.domain, 9U);
  EXPECT_EQ(read_isg_settings(none, file)->options.domain, 0U);
  EXPECT_EQ(read_isg_settings(nothing, folder.path() / "none")->options.domain, 0U);
}

TEST(IsgSettings, NameTheVariableThatIsWrong) {
  EXPECT_EQ(read({{"MILLRACE_DOMAIN", "233"}}).error(),
            "MILLRACE_DOMAIN=233: expected a number from 0 to 232");
  EXPECT_THAT(read({{"MILLRACE_DOMAIN", "x"}}).error(), HasSubstr("MILLRACE_DOMAIN=x"));
  EXPECT_THAT(read({{"MILLRACE_CHANNELS", "cnc"}}).error(), HasSubstr("MACHINE/N"));
  EXPECT_THAT(read({{"MILLRACE_DELIVERY", "once"}}).error(), HasSubstr("at-least-once"));
  EXPECT_THAT(read({{"MILLRACE_COMPLETION_SIGNAL", "text"}}).error(),
              HasSubstr("response-state or response"));
  EXPECT_THAT(read({{"MILLRACE_LOG_LEVEL", "loud"}}).error(), HasSubstr("trace"));
}

}  // namespace
}  // namespace millrace::services::sdk
