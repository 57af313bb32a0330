// Blocks of words and assignments.
#include <algorithm>
#include <utility>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/operations.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

constexpr std::size_t most_words = 1'000;

}  // namespace

Result<void> Execution::read_block_number() {
  const auto& number = state_.operation().number;
  if (!number) {
    return {};
  }
  return evaluator_.integer(*number).map([this](long value) {
    state_.frame().block_number = value;
    if (state_.search == value) {
      state_.search.reset();
    }
  });
}

Result<Outcome> Execution::operator()(const syntax::Words& words) {
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
  return collect(words, collected)
      .and_then([&] { return state_.around.motion.interpret(collected); })
      .and_then([this](Meaning meaning) { return apply(std::move(meaning)); });
}

Result<Outcome> Execution::apply(Meaning meaning) {
  const bool with_message = std::ranges::any_of(data_orders_, [](const DataOrder& order) {
    return std::holds_alternative<WriteMessage>(order);
  });
  // Written at the beginning of the motion (our choice).
  for (DataOrder& order : data_orders_) {
    push(DataWrite{std::move(order)});
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
      return fault(0,
                   "M17 and M29 end a subprogram, but this is the main program; end it with M30");
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

Result<void> Execution::collect(const syntax::Words& block, std::vector<WordValue>& words) {
  for (const syntax::WordsItem& item : block.items) {
    auto collected = std::visit([&](const auto& node) { return collect(node, words); }, item);
    if (!collected) {
      return collected;
    }
  }
  return {};
}

Result<void> Execution::collect(const syntax::Word& word, std::vector<WordValue>& words) {
  if (words.size() == most_words) {
    return fault(0, "the block has more than " + std::to_string(most_words) + " words");
  }
  return evaluator_.number(word.value).map([&](double value) {
    words.push_back({word.address, value});
  });
}

Result<void> Execution::collect(const syntax::Assignment& assignment, std::vector<WordValue>&) {
  return value_for(assignment.target, assignment.value).and_then([&](const Value& value) {
    return assignment.operation ? change(assignment.target, *assignment.operation, value)
                                : evaluator_.write(assignment.target, value);
  });
}

// A quoted text is a macro or a string: the type of the variable decides.
Result<Value> Execution::value_for(const syntax::Reference& target,
                                   const syntax::Expression& value) {
  const auto* text = std::get_if<syntax::Text>(&value.node);
  if (text != nullptr && state_.around.macros.contains(text->text)) {
    const auto present = evaluator_.read(target);
    if (present && std::holds_alternative<std::string>(*present)) {
      return text->text;
    }
  }
  return evaluator_.evaluate(value);
}

Result<void> Execution::change(const syntax::Reference& target, values::BinaryOperator operation,
                               const Value& operand) {
  return evaluator_.read(target)
      .and_then([&](const Value& old) { return values::apply(operation, old, operand); })
      .and_then([&](const Value& value) { return evaluator_.write(target, value); });
}

Result<void> Execution::collect(const syntax::MacroDefinition& macro, std::vector<WordValue>&) {
  return state_.around.macros.define(macro.name, macro.text);
}

// Computed when the block is decoded (our choice), written when the interpolator reaches it
// (documented).
Result<void> Execution::collect(const syntax::DataAssignment& assignment, std::vector<WordValue>&) {
  return evaluator_.name_of_variable(assignment.target).and_then([&](const std::string& name) {
    return evaluator_.evaluate_text(assignment.value).map([&](Value value) {
      data_orders_.emplace_back(AssignData{name, std::move(value)});
    });
  });
}

Result<void> Execution::collect(const syntax::QueueMessage& message, std::vector<WordValue>&) {
  const auto queue = evaluator_.name_of_variable(message.queue);
  const auto control = queue ? evaluator_.name_of_variable(message.control) : queue;
  if (!control) {
    return tl::make_unexpected(control.error());
  }
  return evaluator_.evaluate_text(message.value).map([&](Value value) {
    data_orders_.emplace_back(WriteMessage{*queue, *control, std::move(value)});
  });
}

Result<void> Execution::collect(const syntax::QueueInit& init, std::vector<WordValue>&) {
  return evaluator_.name_of_variable(init.control).map([&](std::string control) {
    data_orders_.emplace_back(InitQueue{std::move(control)});
  });
}

Result<void> Execution::collect(const syntax::MacroUse& macro, std::vector<WordValue>& words) {
  if (auto counted = evaluator_.count_macro(macro.name); !counted) {
    return counted;
  }
  if (macro_depth_ == deepest_macro) {
    return fault(0, "macros are nested deeper than " + std::to_string(deepest_macro) +
                        " levels, or \"" + macro.name + "\" uses itself");
  }
  const auto block = state_.around.macros.words(macro.name);
  if (!block) {
    return tl::make_unexpected(block.error());
  }
  ++macro_depth_;
  auto collected = collect(**block, words);
  --macro_depth_;
  return collected;
}

}  // namespace millrace::cnc::nc::run
