// The statements of a program's blocks. The interpreter visits them; program.hpp has their order.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cnc/nc/syntax/expression.hpp"
#include "cnc/nc/variable_info.hpp"

namespace millrace::cnc::nc::syntax {

/// G01, X[-2*P1], M30: an address and its value. The bare value of `G04 3.0` has the address "".
struct Word {
  std::string address;
  Expression value;
  /// M52=-345, H5=P1: a value for the PLC (IB/tccncprogramming/15556839051, documented).
  std::optional<Expression> argument{};
};

/// A documented statement that has no effect on the virtual CNC (manual.hpp): a # command, or an
/// axis function Z[DIST_CTRL …] among the words of a block.
struct Skipped {
  /// As in "#CONTOUR MODE has no effect".
  std::string name;
  /// It empties the channel, as #FLUSH WAIT does.
  bool flushes = false;
};

/// P1 = 3, V.P.A += 2.
struct Assignment {
  Reference target;
  /// Nullopt for `=`.
  std::optional<values::BinaryOperator> operation;
  Expression value;
};

/// "NAME" = "text"
struct MacroDefinition {
  std::string name;
  std::string text;
};

/// "NAME" among the words of a block: replaced by the text of the macro.
struct MacroUse {
  std::string name;
};

/// SSD[SD.NAME = value] and SSDE: assigned when the interpolator reaches the block.
struct DataAssignment {
  Variable target;
  Expression value;
};

/// SSDQ[SD.QUEUE, SD.CONTROL, value]: adds a message to the end of a queue.
struct QueueMessage {
  Variable queue;
  Variable control;
  Expression value;
};

/// SSDQInit[SD.CONTROL]: empties the queue.
struct QueueInit {
  Variable control;
};

using WordsItem = std::variant<Word, Assignment, MacroDefinition, MacroUse, DataAssignment,
                               QueueMessage, QueueInit, Skipped>;

/// A block of words and assignments.
struct Words {
  std::vector<WordsItem> items;
  /// "M30/": a misprint of the vendor's sample (IB/tf5200_service_interface/356533387), which is
  /// read as M30.
  bool misprinted_end = false;
};

/// How a condition is evaluated (IB/tf5200_programming_manual/206901003, 206940939, 206946827).
enum class ConditionRule {
  half_or_beyond,  // |value| >= 0.5: $IF, $WHILE
  above_half,      // value > 0.5: $UNTIL, #WAIT FOR
  half_or_above    // value >= 0.5: $ENDDO
};

/// Goes to another operation of the routine.
struct Jump {
  std::size_t target = 0;
};

/// Goes to the target if the condition's truth is `when`.
struct Branch {
  Expression condition;
  ConditionRule rule = ConditionRule::half_or_beyond;
  bool when = false;
  std::size_t target = 0;
};

/// $FOR: sets the counter on entry; EndFor steps it and returns to after this operation.
struct For {
  Reference counter;
  Expression start;
  Expression end;
  Expression step;
  /// The operation after the loop.
  std::size_t exit = 0;
};
struct EndFor {
  std::size_t loop = 0;
};

struct SwitchCase {
  Expression value;
  std::size_t target = 0;
};
/// $SWITCH: goes to the first case within 0.001 of the selector
/// (IB/tf5200_programming_manual/206908427, documented).
struct Switch {
  Expression selector;
  std::vector<SwitchCase> cases;
  /// $DEFAULT, or the operation after the end.
  std::size_t otherwise = 0;
};

/// A literal name, or the variable that contains it.
using Name = std::variant<std::string, Variable>;

/// $GOTO N<number>, $GOTO [NAME] or $GOTO V.E.name
struct Goto {
  std::variant<Expression, Name> target;
};

enum class FlushKind { stop, go_on, wait };

/// #FLUSH, #FLUSH CONTINUE, #FLUSH WAIT
struct Flush {
  FlushKind kind{};
};

/// #WAIT FOR
struct WaitFor {
  Expression condition;
};

/// "text", value, value … in the forms of #MSG.
struct FormattedText {
  std::string format;
  std::vector<Expression> values;
};

/// #MSG SAVE
struct SaveMessage {
  FormattedText text;
  bool time_stamp = true;
  bool line_end = true;
};

/// #MSG and #MSG INFO
struct Message {
  FormattedText text;
  std::string receiver;
  /// Sent by the interpolator when it reaches the block, not by the decoder.
  bool synchronous = false;
  bool acknowledge = false;
  bool info = false;
};

/// L and LL: a subprogram in its own file, or in this one.
struct SubprogramCall {
  bool local = false;
  Name name;
};

/// When a modal cycle is called again.
enum class CycleRepeat { once, after_motion, after_block };

struct CycleArgument {
  Expression number;
  Expression value;
};

/// L CYCLE and LL CYCLE
struct CycleCall {
  bool local = false;
  Name name;
  CycleRepeat repeat = CycleRepeat::once;
  std::vector<CycleArgument> arguments;
};

/// #DISABLE MODAL CYCLE
struct EndModalCycle {};

enum class TimerAction { start, stop, read, clear };

/// #TIMER
struct TimerCommand {
  TimerAction action{};
  Expression id;
  bool synchronous = false;
};

/// #TIME: a dwell in seconds.
struct TimeCommand {
  Expression seconds;
};

/// #FILE NAME [MSG="…"]; beside it, other names may be set, such as [G80="…"].
struct ReportFile {
  Expression name;
};

/// The greatest n of STRING[n], and that of STRING.
inline constexpr int longest_string = 127;

/// A line between #VAR and #ENDVAR.
struct Declaration {
  Reference variable;
  VariableType type = VariableType::real64;
  /// The n of STRING[n].
  std::optional<Expression> length{};
  std::vector<Expression> initial;
};
struct Declarations {
  std::vector<Declaration> variables;
};

/// #DELETE
struct Deletion {
  std::vector<Reference> variables;
};

/// A parameter of #ERROR: ID, RC, MID, PV1, PM1, PIV1 …
struct ErrorParameter {
  std::string name;
  Expression value;
};
/// #ERROR
struct UserError {
  std::vector<ErrorParameter> parameters;
};

/// #INIT MACRO TAB
struct ForgetMacros {};

/// #INIT V.E.NAME, V.E.NAME …
struct InitExternals {
  std::vector<Reference> variables;
};

using Statement = std::variant<Words, Jump, Branch, For, EndFor, Switch, Goto, SubprogramCall,
                               CycleCall, EndModalCycle, Flush, WaitFor, Message, SaveMessage,
                               ReportFile, TimerCommand, TimeCommand, Declarations, Deletion,
                               UserError, ForgetMacros, InitExternals, Skipped>;

}  // namespace millrace::cnc::nc::syntax
