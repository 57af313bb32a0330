// `millrace lint` as a user starts it, also with a running service.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/sections.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class TheLint : public testing::Test {
 protected:
  TheLint() {
    for (const Section& section : read_sections_in(test_data("lint"))) {
      for (const auto& [name, text] : section.texts) {
        std::ofstream(programs + (name.empty() ? section.name + ".nc" : name)) << text;
      }
    }
  }

  /// Runs `millrace lint ARGS` to its end; returns its output.
  std::string run(std::vector<std::string> args) {
    args.insert(args.begin(), {binary("millrace"), "lint"});
    Process process(std::move(args));
    exit_code = process.wait();
    errors = process.error_output();
    return process.output();
  }

  const TemporaryFolder folder;
  const std::string programs = folder.path().string() + "/";
  int exit_code = -1;
  std::string errors;
};

TEST_F(TheLint, FindsNothingInACorrectProgram) {
  EXPECT_EQ(run({programs + "complete.nc"}), "nothing found\n");
  EXPECT_EQ(exit_code, 0);
}

TEST_F(TheLint, EndsWithOneForErrorsAndForWarningsIfTheyCount) {
  EXPECT_THAT(run({programs + "wait_without_flush.nc"}), HasSubstr("[wait-without-flush]"));
  EXPECT_EQ(exit_code, 0);
  run({"--strict", programs + "wait_without_flush.nc"});
  EXPECT_EQ(exit_code, 1);
  run({programs + "timer_missing.nc"});
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheLint, ReadsSubprogramsNextToTheProgramAndInThePath) {
  EXPECT_THAT(run({programs + "subprograms.nc"}), HasSubstr("ask_and_wait.sub:3:1: warning"));
  EXPECT_THAT(run({programs + "subprograms.nc"}), HasSubstr("somewhere_else.sub was not found"));
}

TEST_F(TheLint, AcceptsOneValueForEachFlag) {
  EXPECT_THAT(run({"--uuid", square_root, programs + "complete.nc"}), HasSubstr("nothing found"));
  EXPECT_THAT(run({"--uuid", "another", programs + "complete.nc"}), HasSubstr("[unknown-uuid]"));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheLint, ReportsWhatItExpects) {
  run({});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("no NC program is named"));
  run({"--off", "no-rule", programs + "complete.nc"});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("--rules"));
  run({programs + "there_is_no_such.nc"});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("No such file"));
}

TEST_F(TheLint, RefusesAFileWithoutAnEnd) {
  const std::string pipe = programs + "pipe.nc";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe, std::string("/dev/zero")}) {
    run({file});
    EXPECT_EQ(exit_code, 2);
    EXPECT_THAT(errors, HasSubstr("cannot read " + file +
                                  ": it is not a regular file; - reads standard input"));
  }
  std::ofstream(programs + "huge.nc").close();
  std::filesystem::resize_file(programs + "huge.nc", std::uintmax_t{1} << 30U);
  run({programs + "huge.nc"});
  EXPECT_THAT(errors, HasSubstr("it has more than 16 MiB"));
  run({"--uuids", pipe, programs + "complete.nc"});
  EXPECT_EQ(exit_code, 2);
}

TEST_F(TheLint, ReadsTheServicesFromTheFabric) {
  const Domain domain;
  const std::string number = std::to_string(domain.number());
  EXPECT_THAT(run({"--live", "--domain", number, programs + "complete.nc"}),
              HasSubstr("[unknown-uuid]"));
  Process service({binary("millrace-square-root"), "--domain", number});
  service.await("^ready");
  EXPECT_THAT(run({"--live", "--domain", number, programs + "complete.nc"}),
              Not(HasSubstr("[unknown-uuid]")));
  EXPECT_EQ(exit_code, 0) << errors;
}

}  // namespace
}  // namespace millrace::tests::integration
