// Scripts that complete a command in a shell.
//
//   fmt::print("{}", completion_script(command_tree(app, "millrace"), Shell::bash));
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/program/command_tree.hpp"

namespace millrace::base::program {

enum class Shell : std::uint8_t { bash, zsh, fish };

/// "bash", "zsh" or "fish".
std::optional<Shell> parse_shell(std::string_view word);

/// Offers subcommands, options, and the valid words of arguments and of options' values. The shell
/// completes all other words, such as file names.
std::string completion_script(const Command& command, Shell shell);

}  // namespace millrace::base::program
