#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/control_parser.hpp"
#include "cnc/nc/syntax/parsers.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

// Limits of a program; our choice.
constexpr std::size_t largest_program = 16U << 20U;
constexpr std::size_t most_blocks = 250'000;
constexpr int skip_levels = 10;
constexpr double largest_block_number = 1e9;

// The value of a literal number in the range of block numbers.
std::optional<long> constant(const Expression& expression) {
  const auto* number = std::get_if<Number>(&expression.node);
  if (number == nullptr || !(std::abs(number->value) < largest_block_number)) {
    return std::nullopt;
  }
  return std::lround(number->value);
}

void sort(std::vector<Diagnostic>& mistakes) {
  std::ranges::stable_sort(mistakes, {}, [](const Diagnostic& mistake) {
    return std::tie(mistake.place.line, mistake.place.column);
  });
}

/// A block of which only the beginning is known.
bool concerns_services(std::string_view block) {
  return upper(block).find("V.G.SERVICE") != std::string::npos;
}

class ProgramParser {
 public:
  ProgramParser(const std::string& file, std::string_view text) : cursor_(file, text, mistakes_) {
    program_.file = file;
  }

  Reading read() {
    while (!cursor_.at_program_end()) {
      parse_block();
      cursor_.finish_block();
      if (cursor_.failed() && concerns_services(cursor_.block_text())) {
        writer_.mark_unclear();
      }
      cursor_.next_block();
      if (writer_.next() > most_blocks) {
        cursor_.report(cursor_.peek().line, 1,
                       "the routine has more than " + std::to_string(most_blocks) +
                           " blocks; split it into subprograms");
        break;
      }
    }
    end_routine();
    check_calls();
    program_.doubts = cursor_.take_doubts();
    sort(mistakes_);
    return {std::move(program_), std::move(mistakes_), cursor_.take_lines_with_mistakes()};
  }

 private:
  void parse_block() {
    writer_.begin_block({cursor_.peek().line, cursor_.peek().column, {}});
    if (cursor_.accept("%")) {
      parse_program_name();
      return;
    }
    BlockHead head;
    head.line = cursor_.peek().line;
    head.column = cursor_.peek().column;
    head.skip_level = parse_skip_level();
    parse_number(head);
    const bool labelled = parse_label();
    const bool numbered = head.number.has_value();
    if (cursor_.at_block_end() && !numbered && !labelled) {
      return;  // An empty line or a comment, which may stand before the % of the main program.
    }
    const bool is_command = cursor_.accept("#");
    if (is_command && cursor_.at_word("COMMENT")) {
      parse_comment(cursor_);
      return;
    }
    begin_block(std::move(head));
    if (is_command) {
      writer_.add(parse_command(cursor_));
      leave_rest_to_a_controller();
    } else if (cursor_.at_block_end()) {
      if (numbered) {
        writer_.add(Words{});  // an operation to show the block number for
      }
    } else {
      parse_statement_block();
    }
    if (!cursor_.externals().empty()) {
      writer_.note_externals(cursor_.externals());
    }
  }

  // %NAME and % NAME begin the main program, %L NAME a local subprogram. The vendor's editor reads
  // a main program without a name.
  void parse_program_name() {
    if (cursor_.at_block_end()) {
      if (in_main_) {
        cursor_.fail_unknown("a % without a name stands behind the main program");
      } else {
        begin_main({});
      }
      return;
    }
    const bool may_be_local = cursor_.at_word("L");
    const Token name = cursor_.take_raw_word();
    if (may_be_local && !cursor_.at_block_end()) {
      begin_subprogram();
    } else {
      begin_main(name);
    }
  }

  void begin_subprogram() {
    const Token name = cursor_.take_raw_word();
    end_routine();
    if (in_main_) {
      cursor_.fail_unknown_at(name, "local subprograms stand before the main program");
    }
    const auto [entry, added] = program_.subprograms.try_emplace(std::string(name.text));
    if (!added) {
      cursor_.fail_at(name, "the subprogram " + std::string(name.text) + " exists already");
    }
    entry->second.name = name.text;
    writer_.begin_routine(entry->second);
  }

  void begin_main(const Token& name) {
    end_routine();
    if (in_main_) {
      cursor_.fail_at(name, "the file has a main program already");
    }
    in_main_ = true;
    program_.main.name = name.text;
    writer_.begin_routine(program_.main);
  }

  // Checks what must be complete within a routine.
  void end_routine() {
    control_.finish();
    check_targets();
  }

  std::uint8_t parse_skip_level() {
    if (!cursor_.accept("/")) {
      return 0;
    }
    if (cursor_.peek().kind != TokenKind::number || !cursor_.peek().adjacent) {
      return 1;
    }
    const double level = cursor_.peek().number;
    if (level < 1 || level > skip_levels || level != std::floor(level)) {
      cursor_.fail("the level of a skipped block is 1 to " + std::to_string(skip_levels));
      return 0;
    }
    cursor_.take();
    return static_cast<std::uint8_t>(level);
  }

  void parse_number(BlockHead& head) {
    if (cursor_.peek().kind != TokenKind::name || upper(cursor_.peek().text.front()) != 'N') {
      return;
    }
    cursor_.take_letter();
    head.number = parse_word_value(cursor_);
    const auto number = constant(*head.number);
    if (!number) {
      return;
    }
    cursor_.set_block_number(*number);
    if (cursor_.accept(":") && !routine().numbers.emplace(*number, writer_.next()).second) {
      cursor_.fail("the jump target N" + std::to_string(*number) + ": exists already");
    }
  }

  /// Labels are the same in any case (inferred from programs of machines).
  bool parse_label() {
    if (!cursor_.accept("[")) {
      return false;
    }
    const std::string name(cursor_.take_raw_word().text);
    cursor_.expect("]");
    cursor_.accept(":");
    if (name.empty() || !routine().labels.emplace(upper(name), writer_.next()).second) {
      cursor_.fail("the label [" + name + "] is empty or exists already");
    }
    return true;
  }

  // The first block decides: without a % the whole file is the main program.
  void begin_block(BlockHead head) {
    in_main_ = in_main_ || &writer_.routine() == &program_.main;
    writer_.begin_block(std::move(head));
  }

  void parse_statement_block() {
    if (!cursor_.peek().is("$") && !at_call(cursor_)) {
      writer_.add(parse_words(cursor_));
    }
    if (at_call(cursor_)) {
      writer_.add(parse_call(cursor_));
      leave_rest_to_a_controller();
    } else if (cursor_.peek().is("$")) {
      parse_control();
    }
  }

  /// Words behind a command or a call may be those of a newer controller.
  void leave_rest_to_a_controller() {
    if (cursor_.peek().kind == TokenKind::name || cursor_.peek().is("[")) {
      cursor_.fail_unknown(describe(cursor_.peek()) + " is not expected here");
    }
  }

  void parse_control() {
    const bool skipped = writer_.head().skip_level > 0;
    const Token statement = cursor_.take();
    control_.parse();
    if (skipped) {
      cursor_.fail_unknown_at(statement,
                              "a block with a $ statement cannot be skipped; remove the /");
    }
  }

  // Checks calls of local subprograms with literal names.
  void check_calls() {
    check_calls(program_.main);
    for (const auto& [name, subprogram] : program_.subprograms) {
      check_calls(subprogram);
    }
  }

  void check_calls(const Routine& caller) {
    for (const Operation& operation : caller.operations) {
      const auto* call = std::get_if<SubprogramCall>(&operation.statement);
      const auto* name =
          call != nullptr && call->local ? std::get_if<std::string>(&call->name) : nullptr;
      if (name != nullptr && !name->empty() && !program_.subprograms.contains(*name)) {
        report(operation, "LL " + *name + ", but the file has no subprogram %L " + *name);
      }
    }
  }

  // Literal targets of $GOTO can be checked before the program runs.
  void check_targets() {
    for (const Operation& operation : routine().operations) {
      const auto* jump = std::get_if<Goto>(&operation.statement);
      if (jump == nullptr) {
        continue;
      }
      if (const auto* name = std::get_if<Name>(&jump->target)) {
        const auto* label = std::get_if<std::string>(name);
        if (label != nullptr && !routine().labels.contains(upper(*label))) {
          report(operation, "$GOTO to [" + *label + "], which is nowhere in this routine");
        }
      } else if (const auto number = constant(std::get<Expression>(jump->target));
                 number && !routine().numbers.contains(*number)) {
        report(operation, "$GOTO to N" + std::to_string(*number) +
                              ", but no block of this routine begins with that number and a colon");
      }
    }
  }

  // A mistake of an operation that was read earlier.
  void report(const Operation& operation, std::string text) {
    const auto number = operation.number ? constant(*operation.number) : std::nullopt;
    cursor_.report({program_.file, operation.line, operation.column, number.value_or(0)},
                   std::move(text));
  }

  Routine& routine() { return writer_.routine(); }

  Program program_;
  std::vector<Diagnostic> mistakes_;
  Cursor cursor_;
  RoutineWriter writer_{program_.main};
  ControlParser control_{cursor_, writer_};
  bool in_main_ = false;
};

}  // namespace

Reading read_program(const std::string& file, std::string_view text) {
  if (text.size() > largest_program) {
    return {{},
            {{{file, 0, 0, 0}, 0, "the program is larger than 16 MiB; split it into subprograms"}},
            {1}};
  }
  return ProgramParser(file, text).read();
}

tl::expected<Program, std::vector<Diagnostic>> parse_program(const std::string& file,
                                                             std::string_view text) {
  Reading reading = read_program(file, text);
  if (reading.mistakes.empty()) {
    return std::move(reading.program);
  }
  std::vector<Diagnostic>& mistakes = reading.mistakes;
  mistakes.insert(mistakes.end(), reading.program.doubts.begin(), reading.program.doubts.end());
  sort(mistakes);
  return tl::make_unexpected(std::move(mistakes));
}

}  // namespace millrace::cnc::nc::syntax
