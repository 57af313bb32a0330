#include "base/configuration/check.hpp"

#include <array>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "idl/archiver.pb.h"
#include "idl/batch.pb.h"
#include "idl/check.pb.h"
#include "idl/cnc.pb.h"
#include "idl/dial_gauge.pb.h"
#include "idl/fabric.pb.h"
#include "idl/gateway.pb.h"
#include "idl/lcm.pb.h"
#include "idl/mail.pb.h"
#include "idl/web.pb.h"

namespace millrace::base::configuration {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> mistakes_of(const std::string& text) {
  const auto checked =
      load_text<config::Gateway>(text, "g", [](const auto&, Mistakes&) { return true; });
  std::vector<std::string> lines;
  std::istringstream error(checked ? "" : checked.error());
  for (std::string line; std::getline(error, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// A machine with these fields and no mistake.
std::string machine(const std::string& fields) {
  return "machine { name: 'press' host: 'a' net_id: 'b'\n" + fields + " }";
}

TEST(Check, AcceptsAGoodConfiguration) {
  EXPECT_THAT(mistakes_of(""), IsEmpty());
  EXPECT_THAT(mistakes_of(machine("port: 65535 data { name: 'a' variable: 'x' deadband: 1e30 }")),
              IsEmpty());
}

TEST(Check, NamesEachMistakeInTheOrderOfTheFile) {
  EXPECT_THAT(
      mistakes_of("service {\n uuid: ' ' }\nmachine { host: ''\nport: 0 name: 'a b' }"),
      ElementsAre(R"(g:2:2: service.uuid: " "; expected 1 to 127 bytes, the UUID of a service)",
                  R"(g:3:1: machine.net_id: is missing; expected net_id: "10.0.0.5.1.1")",
                  R"(g:3:11: machine.host: is missing; expected host: "10.0.0.5")",
                  "g:4:1: machine.port: 0; expected 1 to 65535",
                  R"(g:4:9: machine.name: "a b"; expected 1 to 63 letters, digits, '_' )"
                  R"(and '-', as in "press1")"));
}

TEST(Check, LimitsNumbers) {
  EXPECT_THAT(mistakes_of(machine("channel: 255 channel: 256")),
              ElementsAre("g:2:14: machine.channel: 256; expected 1 to 255"));
  for (const char* wrong : {"-0.5", "nan", "inf", "-inf"}) {
    EXPECT_THAT(mistakes_of(machine(
                    "data { name: 'a' variable: 'x' deadband: " + std::string(wrong) + " }")),
                ElementsAre(HasSubstr(std::string(wrong) + "; expected 0 or more")));
  }
}

TEST(Check, LimitsTextsAndTheirForm) {
  const auto queue = [](const std::string& control) {
    return mistakes_of(machine("queue { name: 'a' uuid: 'u' control: '" + control + "' }"));
  };
  EXPECT_THAT(queue(std::string(200, 'a')), IsEmpty());
  EXPECT_THAT(
      queue(std::string(201, 'a')),
      ElementsAre(HasSubstr("aaa\"; expected 1 to 200 ASCII characters without blanks, as in "
                            "\"SD.CONTROL\"")));
  EXPECT_THAT(queue("a b"), ElementsAre(HasSubstr("\"a b\"; expected")));
  EXPECT_THAT(queue(R"(a\033[2J)"), ElementsAre(HasSubstr(R"("a\x1b[2J"; expected)")));
  EXPECT_THAT(queue(R"(a\377)"), ElementsAre(HasSubstr(R"("a\xff"; expected)")));
  const auto program = [](const std::string& name) {
    return mistakes_of(machine("programs { name: '" + name + "' }"));
  };
  EXPECT_THAT(program("Maß a"), IsEmpty());
  for (const char* wrong : {"", R"(a\n)", R"(\377)"}) {
    EXPECT_THAT(program(wrong), ElementsAre(HasSubstr("expected 1 to 255 bytes of UTF-8")))
        << wrong;
  }
  EXPECT_THAT(mistakes_of("service { uuid: 'a*' }"),
              ElementsAre(HasSubstr("the UUID of a service")));
}

TEST(Check, LimitsTheElementsOfAList) {
  std::string queues;
  for (int i = 0; i < 65; ++i) {
    const std::string name = "q" + std::to_string(i);
    queues += "queue { name: '" + name + "' control: '" + name + "' uuid: 'u' }\n";
  }
  EXPECT_THAT(mistakes_of(machine(queues)),
              ElementsAre("g:66:1: machine.queue: there are 65; expected at most 64"));
}

TEST(Check, FindsValuesThatOccurTwice) {
  EXPECT_THAT(mistakes_of(machine("data { name: 'a' variable: ['x', 'y', 'x'] }")),
              ElementsAre(R"(g:2:18: machine.data.variable: "x" occurs twice)"));
  EXPECT_THAT(mistakes_of(machine("programs { }\nprograms { channel: 1 }")),
              ElementsAre("g:3:12: machine.programs.channel: 1 occurs twice"))
      << "the default is a value, too";
  EXPECT_THAT(mistakes_of(machine("data { name: 'a' variable: 'x' }\n"
                                  "data { name: 'a' variable: 'x' channel: 2 }\n"
                                  "data { name: 'a' variable: 'x' channel: 1 }")),
              ElementsAre(R"(g:4:8: machine.data.name: "a" occurs twice with channel: 1)"));
}

TEST(Check, LetsTheConversionAddMistakesOfOtherFields) {
  const auto sut = load_text<
      config::Gateway>("machine { port: 0 }", "g", [](const config::Gateway&, Mistakes& mistakes) {
    mistakes.expect(false, {{"machine", 0}, {"port"}}, "not reported, since it is wrong anyway");
    mistakes.expect(false, {{"machine", 0}, {"host"}}, "the same");
    mistakes.expect(false, {{"journal"}}, "is wrong");
    return 1;
  });
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), testing::StartsWith("g: journal: is wrong\ng:1:1: machine.name: is "));
  EXPECT_THAT(sut.error(), testing::Not(HasSubstr("not reported")));
}

TEST(Check, AcceptsAnyBytes) {
  std::mt19937 random(1);  // NOLINT: the same values in each run
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 200; ++i) {
    config::Gateway config;
    const auto text = [&] {
      std::string bytes(static_cast<std::size_t>(byte(random)), '\0');
      std::ranges::generate(bytes, [&] { return static_cast<char>(byte(random)); });
      return bytes;
    };
    auto* const machine = config.add_machine();
    machine->set_name(text());
    machine->add_channel(std::numeric_limits<std::uint32_t>::max());
    auto* const data = machine->add_data();
    data->add_variable(text());
    data->set_deadband(std::numeric_limits<double>::quiet_NaN());
    config.add_service()->set_uuid(text());
    const ConfigPlaces places;
    Mistakes mistakes(config, places);
    check(config, mistakes);
    EXPECT_FALSE(mistakes.none());
    EXPECT_TRUE(std::ranges::none_of(mistakes.text(), [](char c) {
      return c != '\n' && (static_cast<unsigned char>(c) < ' ' || c == 0x7F);
    }));
  }
}

/// The fields of a message and of all messages in it.
std::vector<const google::protobuf::FieldDescriptor*> fields_of(
    const google::protobuf::Descriptor& type) {
  std::vector<const google::protobuf::FieldDescriptor*> all;
  for (int i = 0; i < type.field_count(); ++i) {
    all.push_back(type.field(i));
    if (const auto* const inner = type.field(i)->message_type()) {
      std::ranges::copy(fields_of(*inner), std::back_inserter(all));
    }
  }
  return all;
}

TEST(CheckOptions, FitTheTypeOfTheirFieldAndLimitEachNumber) {
  for (const auto* const type :
       {config::Archiver::descriptor(), config::Batch::descriptor(), config::Cnc::descriptor(),
        config::DialGauge::descriptor(), config::Fabric::descriptor(),
        config::Gateway::descriptor(), config::Lcm::descriptor(), config::Mail::descriptor(),
        config::Web::descriptor()}) {
    for (const auto* const field : fields_of(*type)) {
      const config::Check& is = field->options().GetExtension(config::is);
      using Field = google::protobuf::FieldDescriptor;
      const bool is_text = field->cpp_type() == Field::CPPTYPE_STRING;
      const bool is_number = !is_text && field->cpp_type() != Field::CPPTYPE_BOOL &&
                             field->cpp_type() != Field::CPPTYPE_ENUM &&
                             field->cpp_type() != Field::CPPTYPE_MESSAGE;
      EXPECT_TRUE(!is_number || is.has_least() || is.has_most()) << field->full_name();
      EXPECT_TRUE(is_text || is_number || (!is.has_least() && !is.has_most() && !is.once()))
          << field->full_name();
      EXPECT_TRUE(is_text || !is.has_form()) << field->full_name();
      EXPECT_TRUE(field->is_repeated() || !is.has_at_most()) << field->full_name();
      EXPECT_TRUE(!is.has_per() || field->containing_type()->FindFieldByName(is.per()) != nullptr)
          << field->full_name();
    }
  }
}

}  // namespace
}  // namespace millrace::base::configuration
