#include <algorithm>
#include <array>
#include <charconv>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/manual.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

// The second word of a command. Another one may be that of a newer controller.
void expect_word(Cursor& cursor, std::string_view word) {
  if (!cursor.accept_word(word)) {
    cursor.fail_unknown("'" + std::string(word) + "' expected before " + describe(cursor.peek()));
  }
}

Statement parse_flush(Cursor& cursor) {
  if (cursor.accept_word("CONTINUE")) {
    return Flush{FlushKind::go_on};
  }
  return Flush{cursor.accept_word("WAIT") ? FlushKind::wait : FlushKind::stop};
}

Statement parse_wait_for(Cursor& cursor) {
  expect_word(cursor, "FOR");
  return WaitFor{parse_expression(cursor)};
}

Statement parse_time(Cursor& cursor) {
  return TimeCommand{parse_expression(cursor)};
}

// [MSG="path"], [G80="drill.nc", M6="change.nc"]. Other names than MSG are those of subprograms
// that functions call, which have no effect here.
Statement parse_file_names(Cursor& cursor) {
  std::optional<ReportFile> file;
  Skipped skipped;
  cursor.expect("[");
  do {
    const Token of = cursor.peek();
    if (of.kind != TokenKind::name) {
      cursor.fail("MSG or a function expected before " + describe(of));
      return skipped;
    }
    cursor.take();
    cursor.expect("=");
    Expression name = parse_expression(cursor);
    if (same_word(of.text, "MSG")) {
      file = ReportFile{std::move(name)};
    } else if (skipped.name.empty()) {
      skipped.name = "#FILE NAME [" + std::string(of.text) + "=...]";
    }
  } while (cursor.accept(",") || (!cursor.failed() && cursor.peek().kind == TokenKind::name));
  cursor.expect("]");
  if (file) {
    return *std::move(file);
  }
  return skipped;
}

Statement parse_file(Cursor& cursor) {
  expect_word(cursor, "NAME");
  return parse_file_names(cursor);
}

// ID=5, ID5 and ID 5.
Expression parse_parameter(Cursor& cursor, std::string_view name) {
  if (cursor.accept_word(name)) {
    cursor.accept("=");
    return parse_expression(cursor);
  }
  const std::string_view digits = cursor.peek().text.substr(name.size());
  unsigned number = 0;
  const char* end = digits.data() + digits.size();
  if (const auto read = std::from_chars(digits.data(), end, number);
      read.ptr != end || read.ec != std::errc{}) {
    cursor.fail("a number expected behind " + std::string(name));
  }
  cursor.take();
  return {Number{static_cast<double>(number)}};
}

bool at_parameter(const Cursor& cursor, std::string_view name) {
  const Token& token = cursor.peek();
  return token.kind == TokenKind::name && token.text.size() >= name.size() &&
         same_word(token.text.substr(0, name.size()), name) &&
         std::all_of(token.text.begin() + static_cast<std::ptrdiff_t>(name.size()),
                     token.text.end(), is_digit);
}

struct NamedAction {
  std::string_view name;
  TimerAction action;
};
constexpr std::array<NamedAction, 4> timer_actions = {{{"START", TimerAction::start},
                                                       {"STOP", TimerAction::stop},
                                                       {"READ", TimerAction::read},
                                                       {"CLEAR", TimerAction::clear}}};

// #TIMER READ SYN [ID=3]
Statement parse_timer(Cursor& cursor) {
  TimerCommand timer;
  const auto action =
      std::find_if(timer_actions.begin(), timer_actions.end(),
                   [&](const NamedAction& entry) { return cursor.accept_word(entry.name); });
  if (action == timer_actions.end()) {
    cursor.fail_unknown("START, STOP, READ or CLEAR expected before " + describe(cursor.peek()));
    return timer;
  }
  timer.action = action->action;
  timer.synchronous = cursor.accept_word("SYN");
  cursor.expect("[");
  if (at_parameter(cursor, "ID")) {
    timer.id = parse_parameter(cursor, "ID");
  } else {
    cursor.fail("ID=… expected before " + describe(cursor.peek()));
  }
  cursor.expect("]");
  return timer;
}

constexpr std::array<std::string_view, 3> error_keys = {"ID", "RC", "MID"};
constexpr std::array<std::string_view, 3> error_values = {"PV", "PM", "PIV"};
constexpr std::size_t most_error_parameters = 17;

// ID455, RC=2, PV1=P3
ErrorParameter parse_error_parameter(Cursor& cursor) {
  for (const std::string_view key : error_keys) {
    if (at_parameter(cursor, key)) {
      return {std::string(key), parse_parameter(cursor, key)};
    }
  }
  for (const std::string_view key : error_values) {
    if (at_parameter(cursor, key)) {
      std::string name = upper(cursor.take().text);
      cursor.expect("=");
      return {std::move(name), parse_expression(cursor)};
    }
  }
  cursor.fail_unknown("#ERROR has no parameter " + describe(cursor.peek()) +
                      "; it has ID, RC, MID, PV1 to PV5, PM1 to PM5 and PIV1 to PIV4");
  return {};
}

// #ERROR [ID=455 RC=2 PV1=P3]
Statement parse_error(Cursor& cursor) {
  UserError error;
  cursor.expect("[");
  while (!cursor.at_block_end() && !cursor.peek().is("]")) {
    if (error.parameters.size() == most_error_parameters) {
      cursor.fail("too many parameters of #ERROR");
      break;
    }
    error.parameters.push_back(parse_error_parameter(cursor));
    cursor.accept(",");
  }
  cursor.expect("]");
  return error;
}

// V.E.A, V.E.B[3]
Statement parse_external_init(Cursor& cursor) {
  InitExternals init;
  do {
    const Token token = cursor.peek();
    const std::size_t known = cursor.externals().size();
    if (at_reference(cursor)) {
      init.variables.push_back(parse_reference(cursor));
    }
    if (cursor.externals().size() == known) {
      cursor.fail_at(token, "#INIT takes external variables, V.E.NAME, or MACRO TAB");
      break;
    }
  } while (cursor.accept(","));
  return init;
}

Statement parse_init(Cursor& cursor) {
  if (at_reference(cursor)) {
    return parse_external_init(cursor);
  }
  if (!cursor.accept_word("MAKRO")) {
    expect_word(cursor, "MACRO");
  }
  expect_word(cursor, "TAB");
  return ForgetMacros{};
}

Statement parse_disable(Cursor& cursor) {
  expect_word(cursor, "MODAL");
  expect_word(cursor, "CYCLE");
  return EndModalCycle{};
}

// #CONTOUR MODE ON […]: as documented, without an effect here.
Statement skip_command(Cursor& cursor, const ListedCommand& listed) {
  const Token second = cursor.peek_ahead(1);
  Skipped skipped{"#" + std::string(listed.first), listed.flushes};
  if (second.kind == TokenKind::name) {
    skipped.name += ' ' + std::string(second.text);
  }
  cursor.skip_block();
  return skipped;
}

struct Command {
  std::string_view name;
  Statement (*parse)(Cursor&);
};
// By first words. #COMMENT concerns text and not blocks.
constexpr std::array<Command, 12> commands = {{
    {"DELETE", parse_deletion},
    {"DISABLE", parse_disable},
    {"ERROR", parse_error},
    {"FILE", parse_file},
    {"FILENAME", parse_file_names},
    {"FLUSH", parse_flush},
    {"INIT", parse_init},
    {"MSG", parse_message},
    {"TIME", parse_time},
    {"TIMER", parse_timer},
    {"VAR", parse_declarations},
    {"WAIT", parse_wait_for},
}};

}  // namespace

void parse_comment(Cursor& cursor) {
  const Token word = cursor.take();
  if (!cursor.accept_word("BEGIN")) {
    cursor.fail_at(word, "#COMMENT END without #COMMENT BEGIN", 20569);
  } else if (!cursor.at_block_end()) {
    cursor.fail("#COMMENT BEGIN must be alone in its block", 20566);
  } else if (!cursor.skip_comment_lines()) {
    cursor.report(word.line, word.column, "#COMMENT BEGIN without #COMMENT END", 20566);
  }
}

Statement parse_command(Cursor& cursor) {
  const Token name = cursor.peek();
  if (const auto* const listed = find_listed_command(name.text, cursor.peek_ahead(1).text)) {
    return skip_command(cursor, *listed);
  }
  for (const Command& command : commands) {
    if (cursor.accept_word(command.name)) {
      return command.parse(cursor);
    }
  }
  cursor.fail_unknown_at(name, "unknown command #" + std::string(name.text));
  return Skipped{};
}

}  // namespace millrace::cnc::nc::syntax
