
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr std::size_t longest_name = 83;  // with its path, IB/tf5200_programming_manual/206841355
constexpr std::size_t most_arguments = 200;

Name parse_name(Cursor& cursor) {
  if (cursor.at_word("V")) {
    return std::get<Variable>(parse_reference(cursor));
  }
  const Token first = cursor.peek();
  std::string name = first.kind == TokenKind::string ? unquote(cursor.take().text)
                                                     : std::string(cursor.take_raw_word().text);
  if (name.empty()) {
    cursor.fail_at(first, "the name of a program expected before " + describe(first));
  } else if (name.size() > longest_name) {
    cursor.fail_at(first, "a program name has at most " + std::to_string(longest_name) +
                              " characters with its path");
  }
  return name;
}

CycleArgument parse_argument(Cursor& cursor) {
  cursor.expect("@");
  if (!cursor.accept_word("P")) {
    cursor.fail("the arguments of a cycle are written @P1=value");
    return {};
  }
  CycleArgument argument;
  argument.number = parse_word_value(cursor);
  cursor.expect("=");
  argument.value = parse_expression(cursor);
  return argument;
}

CycleRepeat parse_repeat(Cursor& cursor) {
  if (cursor.accept_word("MODAL_MOVE") || cursor.accept_word("MODAL")) {
    return CycleRepeat::after_motion;
  }
  return cursor.accept_word("MODAL_BLOCK") ? CycleRepeat::after_block : CycleRepeat::once;
}

// [NAME=file.cyc @P1=3 @P2="text"], also with commas.
CycleCall parse_cycle(Cursor& cursor) {
  CycleCall call;
  cursor.expect("[");
  cursor.continue_brackets();
  if (!cursor.accept_word("NAME")) {
    cursor.fail("NAME=… expected before " + describe(cursor.peek()));
  }
  cursor.expect("=");
  call.name = parse_name(cursor);
  cursor.accept(",");
  cursor.continue_brackets();
  call.repeat = parse_repeat(cursor);
  cursor.continue_brackets();
  while (!cursor.at_block_end() && !cursor.peek().is("]")) {
    cursor.accept(",");
    cursor.continue_brackets();
    if (call.arguments.size() == most_arguments) {
      cursor.fail("a cycle takes at most " + std::to_string(most_arguments) + " arguments");
    } else {
      call.arguments.push_back(parse_argument(cursor));
    }
    cursor.continue_brackets();
  }
  cursor.expect("]");
  return call;
}

}  // namespace

bool at_call(const Cursor& cursor) {
  return cursor.at_word("L") || cursor.at_word("LL");
}

Statement parse_call(Cursor& cursor) {
  const bool local = cursor.at_word("LL");
  const Token call_word = cursor.take();
  if (cursor.accept_word("CYCLE")) {
    CycleCall call = parse_cycle(cursor);
    call.local = local;
    return call;
  }
  if (cursor.accept_word("SEQUENCE")) {
    cursor.fail_unknown_at(call_word, "the virtual CNC cannot call parts of programs (L SEQUENCE)");
    return Skipped{};
  }
  if (cursor.at_block_end()) {
    cursor.fail("the name of a subprogram expected behind L");
    return SubprogramCall{};
  }
  return SubprogramCall{local, parse_name(cursor)};
}

}  // namespace millrace::cnc::nc::syntax
