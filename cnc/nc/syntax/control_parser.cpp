#include "cnc/nc/syntax/control_parser.hpp"

#include <algorithm>
#include <string>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr std::size_t deepest_nesting = 100;

}  // namespace

const std::vector<ControlParser::Keyword>& ControlParser::keywords() {
  static const std::vector<Keyword> table = {
      {"IF", &ControlParser::parse_if},           {"ELSEIF", &ControlParser::parse_elseif},
      {"ELSE", &ControlParser::parse_else},       {"ENDIF", &ControlParser::parse_endif},
      {"WHILE", &ControlParser::parse_while},     {"ENDWHILE", &ControlParser::parse_endwhile},
      {"DO", &ControlParser::parse_do},           {"ENDDO", &ControlParser::parse_enddo},
      {"REPEAT", &ControlParser::parse_repeat},   {"UNTIL", &ControlParser::parse_until},
      {"FOR", &ControlParser::parse_for},         {"ENDFOR", &ControlParser::parse_endfor},
      {"SWITCH", &ControlParser::parse_switch},   {"CASE", &ControlParser::parse_case},
      {"DEFAULT", &ControlParser::parse_default}, {"ENDSWITCH", &ControlParser::parse_endswitch},
      {"BREAK", &ControlParser::parse_break},     {"CONTINUE", &ControlParser::parse_continue},
      {"GOTO", &ControlParser::parse_goto},
  };
  return table;
}

std::string_view ControlParser::opening_word(Kind kind) {
  switch (kind) {
    case Kind::if_:
      return "$IF";
    case Kind::while_:
      return "$WHILE";
    case Kind::do_:
      return "$DO";
    case Kind::repeat:
      return "$REPEAT";
    case Kind::for_:
      return "$FOR";
    default:
      return "$SWITCH";
  }
}

void ControlParser::parse() {
  word_ = cursor_.peek();
  for (const Keyword& keyword : keywords()) {
    if (cursor_.accept_word(keyword.name)) {
      (this->*keyword.parse)();
      return;
    }
  }
  cursor_.fail_unknown("unknown statement $" + std::string(cursor_.peek().text));
}

void ControlParser::finish() {
  for (const Open& statement : open_) {
    cursor_.report(statement.line, statement.column,
                   std::string(opening_word(statement.kind)) + " is never closed");
  }
  open_.clear();
}

void ControlParser::open(Kind kind, std::size_t begin) {
  if (open_.size() == deepest_nesting) {
    cursor_.fail("statements are nested deeper than " + std::to_string(deepest_nesting) +
                 " levels");
  }
  open_.push_back({kind, writer_.head().line, writer_.head().column, begin, none, {}, {}});
}

ControlParser::Open* ControlParser::innermost(Kind kind) {
  if (!open_.empty() && open_.back().kind == kind) {
    return &open_.back();
  }
  const std::string word = '$' + upper(word_.text);
  const bool opened = std::any_of(open_.begin(), open_.end(),
                                  [&](const Open& statement) { return statement.kind == kind; });
  if (!opened) {
    cursor_.fail_at(word_, word + " without " + std::string(opening_word(kind)));
    return nullptr;
  }
  // Drops the statements left open inside, so that one slip is one mistake.
  cursor_.fail_at(word_, word + ", but the " + std::string(opening_word(open_.back().kind)) +
                             " of line " + std::to_string(open_.back().line) + " is still open");
  while (open_.back().kind != kind) {
    open_.pop_back();
  }
  return &open_.back();
}

void ControlParser::set_target(std::size_t operation, std::size_t target) {
  Statement& statement = writer_.routine().operations[operation].statement;
  if (auto* jump = std::get_if<Jump>(&statement)) {
    jump->target = target;
  } else if (auto* branch = std::get_if<Branch>(&statement)) {
    branch->target = target;
  } else if (auto* loop = std::get_if<For>(&statement)) {
    loop->exit = target;
  }
}

void ControlParser::patch(const std::vector<std::size_t>& operations, std::size_t target) {
  for (const std::size_t operation : operations) {
    set_target(operation, target);
  }
}

void ControlParser::close() {
  patch(open_.back().exits, writer_.next());
  open_.pop_back();
}

void ControlParser::parse_if() {
  Expression condition = parse_expression(cursor_);
  const std::size_t branch =
      writer_.add(Branch{std::move(condition), ConditionRule::half_or_beyond, false, 0});
  if (cursor_.accept("$")) {  // $IF … $GOTO … in one block has no $ENDIF
    if (!cursor_.accept_word("GOTO")) {
      cursor_.fail("only $GOTO may follow $IF in its block");
      return;
    }
    parse_goto();
    set_target(branch, writer_.next());
    return;
  }
  open(Kind::if_, branch);
  open_.back().branch = branch;
}

// Begins another part: the previous one jumps to after $ENDIF, its condition jumps here.
void ControlParser::begin_if_part(Open& statement) {
  if (statement.branch == none) {
    cursor_.fail_at(word_, "$ELSE was the last part of this $IF");
    return;
  }
  statement.exits.push_back(writer_.add(Jump{}));
  set_target(statement.branch, writer_.next());
  statement.branch = none;
}

void ControlParser::parse_elseif() {
  Open* statement = innermost(Kind::if_);
  if (statement == nullptr) {
    return;
  }
  begin_if_part(*statement);
  Expression condition = parse_expression(cursor_);
  statement->branch =
      writer_.add(Branch{std::move(condition), ConditionRule::half_or_beyond, false, 0});
}

void ControlParser::parse_else() {
  if (Open* statement = innermost(Kind::if_)) {
    begin_if_part(*statement);
  }
}

void ControlParser::parse_endif() {
  Open* statement = innermost(Kind::if_);
  if (statement == nullptr) {
    return;
  }
  if (statement->branch != none) {
    statement->exits.push_back(statement->branch);
  }
  close();
}

void ControlParser::parse_while() {
  const std::size_t begin = writer_.next();
  Expression condition = parse_expression(cursor_);
  open(Kind::while_, begin);
  open_.back().exits.push_back(
      writer_.add(Branch{std::move(condition), ConditionRule::half_or_beyond, false, 0}));
}

void ControlParser::parse_endwhile() {
  if (const Open* statement = innermost(Kind::while_)) {
    patch(statement->continues, statement->begin);
    writer_.add(Jump{statement->begin});
    close();
  }
}

void ControlParser::parse_do() {
  open(Kind::do_, writer_.next());
}

void ControlParser::parse_enddo() {
  if (const Open* statement = innermost(Kind::do_)) {
    patch(statement->continues, writer_.next());
    Expression condition = parse_expression(cursor_);
    writer_.add(Branch{std::move(condition), ConditionRule::half_or_above, true, statement->begin});
    close();
  }
}

void ControlParser::parse_repeat() {
  open(Kind::repeat, writer_.next());
}

void ControlParser::parse_until() {
  if (const Open* statement = innermost(Kind::repeat)) {
    patch(statement->continues, writer_.next());
    Expression condition = parse_expression(cursor_);
    writer_.add(Branch{std::move(condition), ConditionRule::above_half, false, statement->begin});
    close();
  }
}

void ControlParser::parse_for() {
  For loop;
  if (at_reference(cursor_)) {
    loop.counter = parse_reference(cursor_);
  } else {
    cursor_.fail(
        "the counter of $FOR is a parameter or a variable, not " + describe(cursor_.peek()), 20227);
  }
  cursor_.expect("=");
  loop.start = parse_expression(cursor_);
  cursor_.expect(",");
  loop.end = parse_expression(cursor_);
  cursor_.expect(",");
  loop.step = parse_expression(cursor_);
  const std::size_t begin = writer_.add(std::move(loop));
  open(Kind::for_, begin);
  open_.back().exits.push_back(begin);
}

void ControlParser::parse_endfor() {
  if (const Open* statement = innermost(Kind::for_)) {
    patch(statement->continues, writer_.next());
    writer_.add(EndFor{statement->begin});
    close();
  }
}

void ControlParser::parse_switch() {
  Expression selector = parse_expression(cursor_);
  open(Kind::switch_, writer_.add(Switch{std::move(selector), {}, none}));
}

void ControlParser::parse_case() {
  if (const Open* statement = innermost(Kind::switch_)) {
    Expression value = parse_expression(cursor_);
    writer_.at<Switch>(statement->begin).cases.push_back({std::move(value), writer_.next()});
  }
}

void ControlParser::parse_default() {
  if (const Open* statement = innermost(Kind::switch_)) {
    auto& selection = writer_.at<Switch>(statement->begin);
    if (selection.otherwise != none) {
      cursor_.fail_at(word_, "this $SWITCH has a $DEFAULT already");
    }
    selection.otherwise = writer_.next();
  }
}

void ControlParser::parse_endswitch() {
  if (const Open* statement = innermost(Kind::switch_)) {
    auto& selection = writer_.at<Switch>(statement->begin);
    if (selection.otherwise == none) {
      selection.otherwise = writer_.next();
    }
    close();
  }
}

void ControlParser::parse_break() {
  const auto inner = std::find_if(open_.rbegin(), open_.rend(), [](const Open& statement) {
    return statement.kind != Kind::if_;
  });
  if (inner == open_.rend()) {
    cursor_.fail_at(word_, "$BREAK outside a loop and a $SWITCH");
    return;
  }
  inner->exits.push_back(writer_.add(Jump{}));
}

void ControlParser::parse_continue() {
  const auto inner = std::find_if(open_.rbegin(), open_.rend(), [](const Open& statement) {
    return statement.kind != Kind::if_ && statement.kind != Kind::switch_;
  });
  if (inner == open_.rend()) {
    cursor_.fail_at(word_, "$CONTINUE outside a loop");
    return;
  }
  inner->continues.push_back(writer_.add(Jump{}));
}

void ControlParser::parse_goto() {
  Goto jump;
  if (cursor_.accept("[")) {
    jump.target = Name(std::string(cursor_.take_raw_word().text));
    cursor_.expect("]");
  } else if (cursor_.at_word("V") || cursor_.at_word("VS")) {
    jump.target = Name(std::get<Variable>(parse_reference(cursor_)));
  } else if (cursor_.peek().kind == TokenKind::name &&
             (cursor_.peek().text.front() == 'N' || cursor_.peek().text.front() == 'n')) {
    cursor_.take_letter();
    jump.target = parse_word_value(cursor_);
  } else {
    cursor_.fail("$GOTO takes N<number>, [NAME] or a string variable");
  }
  if (!cursor_.at_block_end()) {
    cursor_.fail("$GOTO must be the last in its block");
  }
  if (!cursor_.failed()) {
    writer_.add(std::move(jump));
  }
}

}  // namespace millrace::cnc::nc::syntax
