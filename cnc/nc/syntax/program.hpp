// A parsed program: routines, each a flat list of operations. Control statements are jumps with
// resolved targets, so a $GOTO may go anywhere within its routine and the interpreter needs no
// stack for loops.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

/// An external variable in a block.
struct ExternalUse {
  std::string name;
  /// Vs.E.NAME: synchronous here, independent of the variable's setting.
  bool synchronous = false;
};

/// One step of the decoder: a block, or a part of one.
struct Operation {
  int line = 0;
  int column = 0;
  /// The N number, which may be an expression.
  std::optional<Expression> number;
  /// Level of a skippable block (/ or /n), 0 = never skipped.
  std::uint8_t skip_level = 0;
  /// External variables (V.E.) that it uses, without indices.
  std::vector<ExternalUse> externals;
  Statement statement;
  /// A mistake ends its block, which names V.G.SERVICE: it may do more than it shows.
  bool unclear = false;
};

/// A main program or a subprogram.
struct Routine {
  std::string name;
  std::vector<Operation> operations;
  /// Targets of $GOTO: `N100:` and `[NAME]`, as indices of operations.
  std::map<long, std::size_t> numbers;
  /// In capital letters.
  std::map<std::string, std::size_t, std::less<>> labels;
};

struct Program {
  std::string file;
  Routine main;
  /// Local subprograms by name.
  std::map<std::string, Routine, std::less<>> subprograms;
  /// Mistakes that only fail on execution: unknown members of V.G.SERVICE.
  std::vector<Diagnostic> doubts;
};

// Parses the text of a program into its routines, and collects every mistake.
//
//   auto parsed = parse_program("demo.nc", text);
//   if (!parsed) for (const Diagnostic& mistake : parsed.error()) …

/// A program as far as it can be read, for checks. A block with a mistake has what stands before
/// the mistake.
struct Reading {
  Program program;
  /// At most 200, in the order of the text.
  std::vector<Diagnostic> mistakes;
  /// The lines of all blocks with mistakes, also of those beyond the 200.
  std::vector<int> lines_with_mistakes;
};
[[nodiscard]] Reading read_program(const std::string& file, std::string_view text);

/// The parsed program (which may still have `Program::doubts`), or all of its mistakes (at most
/// 200), in the order of the text.
[[nodiscard]] tl::expected<Program, std::vector<Diagnostic>> parse_program(const std::string& file,
                                                                           std::string_view text);

}  // namespace millrace::cnc::nc::syntax
