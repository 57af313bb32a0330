// Blocks of words and assignments.
#include <algorithm>
#include <utility>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/operations.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;
using values::must;

constexpr std::size_t most_words = 1'000;

}  // namespace

void Execution::read_block_number() {
  if (const auto& number = state_.operation().number) {
    const long value = evaluator_.integer(*number);
    state_.frame().block_number = value;
    if (state_.search == value) {
      state_.search.reset();
    }
  }
}

Outcome Execution::operator()(const syntax::Words& words) {
  if (state_.around.queue.full()) {
    return Outcome::again;
  }
  if (words.misprinted_end) {
    warn(
        "M30/ is read as M30, without the /, a misprint of the manual's sample; a block that can "
        "be skipped begins "
        "with it",
        0);
  }
  std::vector<WordValue> collected;
  collect(words, collected);
  return apply(state_.around.motion.interpret(collected));
}

Outcome Execution::apply(Meaning meaning) {
  const bool with_message = std::ranges::any_of(data_orders_, [](const DataOrder& order) {
    return std::holds_alternative<WriteMessage>(order);
  });
  // Written at the beginning of the motion (our choice).
  for (DataOrder& order : data_orders_) {
    push(DataWrite{std::move(order)});
  }
  for (const int function : meaning.skipped) {
    note_skipped("G" + std::to_string(function));
  }
  bool moved = false;
  for (Block::Action& action : meaning.actions) {
    auto* motion = std::get_if<Motion>(&action);
    moved = moved || motion != nullptr;
    if (motion != nullptr && with_message) {
      take_a_cycle(*motion);
    }
    push(std::move(action));
  }
  if (meaning.end == BlockEnd::program) {
    finish_program();
    return Outcome::jumped;
  }
  if (meaning.end == BlockEnd::subprogram) {
    if (state_.frames.size() == 1) {
      fail(0, "M17 and M29 end a subprogram, but this is the main program; end it with M30");
    }
    leave_routine();
    return Outcome::jumped;
  }
  return repeat_modal_cycle(moved);
}

// Messages in blocks shorter than a cycle make the motion jerk (documented).
void Execution::take_a_cycle(Motion& motion) {
  if (motion.duration < state_.cycle) {
    motion.duration = state_.cycle;
    warn(
        "SSDQ in a block whose motion is shorter than a cycle of the interpolator: it takes one, "
        "and "
        "the motion jerks");
  }
}

void Execution::collect(const syntax::Words& block, std::vector<WordValue>& words) {
  for (const syntax::WordsItem& item : block.items) {
    std::visit([&](const auto& node) { collect(node, words); }, item);
  }
}

void Execution::collect(const syntax::Word& word, std::vector<WordValue>& words) {
  if (words.size() == most_words) {
    fail(0, "the block has more than " + std::to_string(most_words) + " words");
  }
  WordValue value{word.address, evaluator_.number(word.value)};
  if (word.argument) {
    value.argument = evaluator_.number(*word.argument);
  }
  words.push_back(std::move(value));
}

void Execution::collect(const syntax::Assignment& assignment, std::vector<WordValue>&) {
  const Value value = value_for(assignment.target, assignment.value);
  if (assignment.operation) {
    change(assignment.target, *assignment.operation, value);
  } else {
    evaluator_.write(assignment.target, value);
  }
}

// A quoted text is a macro or a string: the type of the variable decides.
Value Execution::value_for(const syntax::Reference& target, const syntax::Expression& value) {
  const auto* text = std::get_if<syntax::Text>(&value.node);
  if (text != nullptr && state_.around.macros.contains(text->text)) {
    try {
      if (std::holds_alternative<std::string>(evaluator_.read(target))) {
        return text->text;
      }
    } catch (const values::Aborted&) {
      // The assignment creates the variable, or fails.
    }
  }
  return evaluator_.evaluate(value);
}

void Execution::change(const syntax::Reference& target, values::BinaryOperator operation,
                       const Value& operand) {
  evaluator_.write(target, must(values::apply(operation, evaluator_.read(target), operand)));
}

void Execution::collect(const syntax::MacroDefinition& macro, std::vector<WordValue>&) {
  state_.around.macros.define(macro.name, macro.text);
}

// Computed when the block is decoded (our choice), written when the interpolator reaches it
// (documented).
void Execution::collect(const syntax::DataAssignment& assignment, std::vector<WordValue>&) {
  std::string name = evaluator_.name_of_variable(assignment.target);
  data_orders_.emplace_back(
      AssignData{std::move(name), evaluator_.evaluate_text(assignment.value)});
}

void Execution::collect(const syntax::QueueMessage& message, std::vector<WordValue>&) {
  std::string queue = evaluator_.name_of_variable(message.queue);
  std::string control = evaluator_.name_of_variable(message.control);
  data_orders_.emplace_back(
      WriteMessage{std::move(queue), std::move(control), evaluator_.evaluate_text(message.value)});
}

void Execution::collect(const syntax::QueueInit& init, std::vector<WordValue>&) {
  data_orders_.emplace_back(InitQueue{evaluator_.name_of_variable(init.control)});
}

void Execution::collect(const syntax::Skipped& skipped, std::vector<WordValue>&) {
  note_skipped(skipped.name);
}

void Execution::collect(const syntax::MacroUse& macro, std::vector<WordValue>& words) {
  evaluator_.count_macro(macro.name);
  const MacroLevel level(macro_depth_, macro.name);
  collect(*state_.around.macros.words(macro.name), words);
}

}  // namespace millrace::cnc::nc::run
