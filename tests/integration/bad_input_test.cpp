// Invalid requests of programs to each service as a process: every request is answered with a state
// and a text, no command is executed, and the service continues.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/caller.hpp"
#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::SizeIs;
using testing::StartsWith;

struct Served {
  std::string program;
  std::string uuid;
  /// Written to FILE, for the argument --config FILE; empty = no file.
  std::string config;
  /// More arguments.
  std::vector<std::string> arguments;
  /// Allowed states for a bad request; the empty request gets the first.
  std::vector<std::uint32_t> states;
};

std::ostream& operator<<(std::ostream& out, const Served& served) {
  return out << served.program;
}

const std::vector<std::string>& bad_requests() {
  static const std::vector<std::string> requests{
      "",
      "abc",
      "nan",
      "1e999",
      "../../../../etc/passwd",
      "/etc/shadow",
      "$(touch proof)",
      "`touch proof`",
      "x; touch proof",
      "x | touch proof",
      "-rf / & touch proof",
      "'; DROP TABLE put; --",
      "%s%n%999999d{}{0}{call.id}",
      "done a=$(touch\tproof)",
      std::string(127, '\x01'),
      std::string(127, '\xFF'),
      std::string(127, '"'),
      std::string(127, '='),
      std::string(127, ' '),
  };
  return requests;
}

class BadInput : public testing::TestWithParam<Served> {};

TEST_P(BadInput, IsAnsweredAndHarmsNothing) {
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  const Domain domain;
  Caller caller(domain.number());
  std::vector<std::string> command{binary(GetParam().program), "--domain",
                                   std::to_string(domain.number())};
  if (!GetParam().config.empty()) {
    std::ofstream("service.textproto") << GetParam().config;
    command.insert(command.end(), {"--config", "service.textproto"});
  }
  command.insert(command.end(), GetParam().arguments.begin(), GetParam().arguments.end());
  Process sut(command);
  sut.await("^ready: ");
  ASSERT_TRUE(caller.await_instance(GetParam().uuid));
  for (const std::string& request : bad_requests()) {
    const fabric::Reply reply = caller.call(GetParam().uuid, request);
    SCOPED_TRACE("request: " + request + "\nanswer: " + reply.text);
    EXPECT_THAT(GetParam().states, Contains(reply.state));
    EXPECT_THAT(reply.text, SizeIs(testing::Le(127U)));
    EXPECT_EQ(reply.text.find('\0'), std::string::npos);
    if (reply.state != 1) {
      EXPECT_THAT(reply.text, StartsWith("ERROR: "));
    }
    if (request.empty()) {
      EXPECT_EQ(reply.state, GetParam().states.front());
    }
  }
  EXPECT_FALSE(fs::exists("proof"));
  EXPECT_TRUE(sut.running());
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  fs::current_path(before);
}

INSTANTIATE_TEST_SUITE_P(
    Services, BadInput,
    testing::Values(
        Served{"millrace-square-root", "560aacbf-6335-44a9-895a-8b27f3ed5e47", "", {}, {99}},
        Served{"millrace-dial-gauge", "e6f15204-3a7c-4686-9bc3-1400d062127c", "", {}, {10}},
        // Any text is stored, and two of the above are not text.
        Served{"millrace-archiver", "326de49a-633b-4cea-a9b8-1924d7f926a7", "", {}, {10, 1}},
        // The output repeats the request twice, too long for the longest one.
        Served{"millrace-batch",
               "f8346304-c93c-4a7e-9866-aacceffb7e34",
               "",
               {"--exec", test_data("batch/programs/say_request.sh").string(), "--uuid",
                "f8346304-c93c-4a7e-9866-aacceffb7e34"},
               {10, 1, 13}},
        Served{"millrace-mail",
               "b536e110-ca9e-4198-bddb-64331366bedb",
               "server { host: 'localhost' port: 9 } from: 'a@example.com'\n"
               "recipient { name: 'b' address: 'b@example.com' }\n"
               "template { name: 'done' to: 'b' subject: 'x' }\n",
               {},
               {10, 11}}),
    [](const auto& tested) {
      std::string name = tested.param.program.substr(std::string("millrace-").size());
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

TEST(Check, AcceptsGoodAndRefusesBadConfigurations) {
  for (const auto& [program, kind] :
       {std::pair<std::string, std::string>{"millrace-archiver", "archiver"},
        {"millrace-batch", "batch"},
        {"millrace-dial-gauge", "dial_gauge"},
        {"millrace-http", "http"},
        {"millrace-lcm", "lcm"},
        {"millrace-mail", "mail"}}) {
    const TemporaryFolder bad;
    write_bad_configurations(kind, bad.path());
    for (const fs::path& folder : {test_data("config/good"), bad.path()}) {
      const bool good = folder != bad.path();
      std::size_t tried = 0;
      for (const auto& entry : fs::directory_iterator(folder)) {
        if (!entry.path().string().ends_with("." + kind + ".textproto")) {
          continue;
        }
        ++tried;
        Process sut({binary(program), "--config", entry.path().string(), "--check"});
        EXPECT_EQ(sut.wait(), good ? 0 : 2) << entry.path() << sut.error_output();
        EXPECT_EQ(sut.output().find(" is good: ") != std::string::npos, good);
      }
      EXPECT_GT(tried, 0U) << program;
    }
  }
}

}  // namespace
}  // namespace millrace::tests
