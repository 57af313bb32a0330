#include "tools/commands/status/exit_codes.hpp"

#include <gtest/gtest.h>

#include "base/program/command_line.hpp"

namespace millrace::tools::commands::status {
namespace {

using fabric::plant::Concern;
using fabric::plant::Kind;
using fabric::plant::Level;

TEST(TheExitCode, IsTheLowestOfTheConcernsThatNeedSomebody) {
  EXPECT_EQ(exit_code_of(Concerns{}), 0);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::held, .level = Level::look}}), 0);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::program_aborted}, {.kind = Kind::alarm}}),
            exit_alarm);
  EXPECT_EQ(exit_code_of(Concerns{{.kind = Kind::waiting}, {.kind = Kind::link_down}}),
            exit_link_down);
  for (const auto& [kind, code] :
       std::vector<std::pair<Kind, int>>{{Kind::missing, base::program::exit_failed},
                                         {Kind::no_gateway, exit_link_down},
                                         {Kind::gateway_gone, exit_link_down},
                                         {Kind::held, exit_held},
                                         {Kind::unserved, exit_unserved},
                                         {Kind::journal, exit_alarm},
                                         {Kind::program_aborted, exit_program_aborted}}) {
    EXPECT_EQ(exit_code_of(Concern{.kind = kind}), code) << name_of(kind);
  }
}

}  // namespace
}  // namespace millrace::tools::commands::status
