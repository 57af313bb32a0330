// The man page of a program, generated from the same data as its --help.
//
//   fmt::print("{}", man_page(command_tree(app, "millrace-gateway"), "0.1.0"));
#pragma once

#include <string>

#include "base/program/command_tree.hpp"

namespace millrace::base::program {

/// In roff with the macros of man(7), section 1.
std::string man_page(const Command& command, const std::string& version);

}  // namespace millrace::base::program
