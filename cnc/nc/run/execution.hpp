// Executes one operation of a program in the decoder: a visitor of its statement. The statements
// are in files by subject: execution_words, _control, _calls, _commands, _messages.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cnc/nc/run/block.hpp"
#include "cnc/nc/run/decoder_state.hpp"
#include "cnc/nc/run/evaluator.hpp"

namespace millrace::cnc::nc::run {

/// Result of an operation: the decoder continues after it, continues at the operation's target, or
/// tries the same operation again in the next tick. An operation that returns `again` has made no
/// change that a repetition would make twice.
enum class Outcome { done, jumped, again };

class Execution {
 public:
  Execution(DecoderState& state, const Tick& tick)
      : state_(state),
        tick_(tick),
        evaluator_(
            {state.around.memory, state.around.macros, state.around.system, tick.environment}) {}

  /// Reads the block number of the current operation, if it has one.
  values::Result<void> read_block_number();

  values::Result<Outcome> operator()(const syntax::Words& words);

  values::Result<Outcome> operator()(const syntax::Jump& jump);
  values::Result<Outcome> operator()(const syntax::Branch& branch);
  values::Result<Outcome> operator()(const syntax::For& loop);
  values::Result<Outcome> operator()(const syntax::EndFor& end);
  values::Result<Outcome> operator()(const syntax::Switch& selection);
  values::Result<Outcome> operator()(const syntax::Goto& jump);

  values::Result<Outcome> operator()(const syntax::SubprogramCall& call);
  values::Result<Outcome> operator()(const syntax::CycleCall& call);
  values::Result<Outcome> operator()(const syntax::EndModalCycle& end);

  values::Result<Outcome> operator()(const syntax::Flush& flush);
  values::Result<Outcome> operator()(const syntax::WaitFor& wait);
  values::Result<Outcome> operator()(const syntax::TimerCommand& timer);
  values::Result<Outcome> operator()(const syntax::TimeCommand& time);
  values::Result<Outcome> operator()(const syntax::Declarations& declarations);
  values::Result<Outcome> operator()(const syntax::Deletion& deletion);
  values::Result<Outcome> operator()(const syntax::UserError& error);
  values::Result<Outcome> operator()(const syntax::ForgetMacros& forget);
  values::Result<Outcome> operator()(const syntax::InitExternals& init);

  values::Result<Outcome> operator()(const syntax::Message& message);
  values::Result<Outcome> operator()(const syntax::SaveMessage& save);
  values::Result<Outcome> operator()(const syntax::ReportFile& file);

  /// End the current routine, or the whole program.
  void leave_routine();
  void finish_program();

 private:
  // execution_words.cpp
  values::Result<void> collect(const syntax::Words& block, std::vector<WordValue>& words);
  values::Result<void> collect(const syntax::Word& word, std::vector<WordValue>& words);
  values::Result<void> collect(const syntax::Assignment& assignment, std::vector<WordValue>&);
  values::Result<void> collect(const syntax::MacroDefinition& macro, std::vector<WordValue>&);
  values::Result<void> collect(const syntax::MacroUse& macro, std::vector<WordValue>& words);
  values::Result<void> collect(const syntax::DataAssignment& assignment, std::vector<WordValue>&);
  values::Result<void> collect(const syntax::QueueMessage& message, std::vector<WordValue>&);
  values::Result<void> collect(const syntax::QueueInit& init, std::vector<WordValue>&);
  values::Result<void> change(const syntax::Reference& target, values::BinaryOperator operation,
                              const Value& operand);
  values::Result<Value> value_for(const syntax::Reference& target, const syntax::Expression& value);
  values::Result<Outcome> apply(Meaning meaning);
  void take_a_cycle(Motion& motion);
  // execution_control.cpp
  Outcome go_to(std::size_t operation);
  values::Result<Outcome> enter_loop(const syntax::For& loop, std::size_t begin);
  values::Result<Outcome> go_to_number(long number);
  values::Result<Outcome> go_to_label(const std::string& label);
  // execution_calls.cpp
  values::Result<Frame> routine_of(const syntax::Name& name, bool local);
  values::Result<CycleArguments> arguments_of(const syntax::CycleCall& call);
  values::Result<Outcome> enter(Frame frame, std::optional<CycleArguments> arguments);
  values::Result<Outcome> repeat_modal_cycle(bool moved);
  // execution_commands.cpp
  values::Result<void> declare(const syntax::Declaration& declaration);
  values::Result<Outcome> raise(long id, long recovery_class, std::string text);
  // execution_messages.cpp
  values::Result<std::string> text_of(const syntax::FormattedText& text);
  Outcome send(MessageEvent message);

  void push(Block::Action action) {
    state_.around.queue.push({std::move(action), state_.place(), state_.frames.size() - 1,
                              state_.blocks_read + 1, state_.search.has_value()});
  }
  void warn(std::string text, int id = 0);

  DecoderState& state_;
  const Tick& tick_;
  Evaluator evaluator_;
  int macro_depth_ = 0;
  /// The writes of the current block to system data, in their order.
  std::vector<DataOrder> data_orders_;
};

}  // namespace millrace::cnc::nc::run
