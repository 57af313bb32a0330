// Executes one operation of a program in the decoder: a visitor of its statement. The statements
// are in files by subject: execution_words, _control, _commands.
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

/// A fault aborts the program (values::Aborted).
class Execution {
 public:
  Execution(DecoderState& state, const Tick& tick)
      : state_(state),
        tick_(tick),
        evaluator_(
            {state.around.memory, state.around.macros, state.around.system, tick.environment}) {}

  /// Reads the block number of the current operation, if it has one.
  void read_block_number();

  Outcome operator()(const syntax::Words& words);

  Outcome operator()(const syntax::Jump& jump);
  Outcome operator()(const syntax::Branch& branch);
  Outcome operator()(const syntax::For& loop);
  Outcome operator()(const syntax::EndFor& end);
  Outcome operator()(const syntax::Switch& selection);
  Outcome operator()(const syntax::Goto& jump);

  Outcome operator()(const syntax::SubprogramCall& call);
  Outcome operator()(const syntax::CycleCall& call);
  Outcome operator()(const syntax::EndModalCycle& end);

  Outcome operator()(const syntax::Flush& flush);
  Outcome operator()(const syntax::WaitFor& wait);
  Outcome operator()(const syntax::TimerCommand& timer);
  Outcome operator()(const syntax::TimeCommand& time);
  Outcome operator()(const syntax::Declarations& declarations);
  Outcome operator()(const syntax::Deletion& deletion);
  Outcome operator()(const syntax::UserError& error);
  Outcome operator()(const syntax::ForgetMacros& forget);
  Outcome operator()(const syntax::InitExternals& init);
  Outcome operator()(const syntax::Skipped& skipped);

  Outcome operator()(const syntax::Message& message);
  Outcome operator()(const syntax::SaveMessage& save);
  Outcome operator()(const syntax::ReportFile& file);

  /// End the current routine, or the whole program.
  void leave_routine();
  void finish_program();

 private:
  // execution_words.cpp
  void collect(const syntax::Words& block, std::vector<WordValue>& words);
  void collect(const syntax::Word& word, std::vector<WordValue>& words);
  void collect(const syntax::Assignment& assignment, std::vector<WordValue>&);
  void collect(const syntax::MacroDefinition& macro, std::vector<WordValue>&);
  void collect(const syntax::MacroUse& macro, std::vector<WordValue>& words);
  void collect(const syntax::Skipped& skipped, std::vector<WordValue>&);
  void collect(const syntax::DataAssignment& assignment, std::vector<WordValue>&);
  void collect(const syntax::QueueMessage& message, std::vector<WordValue>&);
  void collect(const syntax::QueueInit& init, std::vector<WordValue>&);
  void change(const syntax::Reference& target, values::BinaryOperator operation,
              const Value& operand);
  Value value_for(const syntax::Reference& target, const syntax::Expression& value);
  Outcome apply(Meaning meaning);
  void take_a_cycle(Motion& motion);
  // execution_control.cpp
  Outcome go_to(std::size_t operation);
  Outcome enter_loop(const syntax::For& loop, std::size_t begin);
  Frame routine_of(const syntax::Name& name, bool local);
  CycleArguments arguments_of(const syntax::CycleCall& call);
  Outcome enter(Frame frame, std::optional<CycleArguments> arguments);
  Outcome repeat_modal_cycle(bool moved);
  // execution_commands.cpp
  void declare(const syntax::Declaration& declaration);
  Outcome raise(long id, long recovery_class, std::string text);
  std::string text_of(const syntax::FormattedText& text);
  Outcome send(MessageEvent message);

  void push(Block::Action action) {
    state_.around.queue.push({std::move(action), state_.place(), state_.frames.size() - 1,
                              state_.blocks_read + 1, state_.search.has_value()});
  }
  void warn(std::string text, int id = 0);
  /// Once for each name and program.
  void note_skipped(const std::string& name);

  DecoderState& state_;
  const Tick& tick_;
  Evaluator evaluator_;
  int macro_depth_ = 0;
  /// The writes of the current block to system data, in their order.
  std::vector<DataOrder> data_orders_;
};

}  // namespace millrace::cnc::nc::run
