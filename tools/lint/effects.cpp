#include "tools/lint/effects.hpp"

#include <algorithm>
#include <string_view>

#include "base/text/ascii.hpp"
#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/manual.hpp"
#include "fabric/cases.hpp"
#include "tools/lint/types.hpp"

namespace millrace::tools::lint {

namespace {

using Kind = Effect::Kind;
using cnc::nc::values::BinaryOperator;
using fabric::Cases;

bool is_state(const syntax::Expression& expression) {
  const auto* const variable = std::get_if<syntax::Variable>(&expression.node);
  return variable != nullptr && service_part(*variable) == "RESPONSE_STATE";
}

/// X, Y1, X_ACHSE
bool is_axis(std::string_view address) {
  constexpr std::string_view axes = "XYZABCUVW";
  return !address.empty() && axes.find(cnc::nc::upper(address.front())) != std::string_view::npos &&
         std::ranges::all_of(address.substr(1), [](char c) {
           return base::text::is_digit(c) || cnc::nc::is_letter(c);
         });
}

class Reader {
 public:
  explicit Reader(std::vector<Effect>& effects) : effects_(effects) {}

  void read(const syntax::Expression& expression) {
    std::visit(
        Cases{[](const syntax::Missing&) {}, [](const syntax::Number&) {},
              [](const syntax::Text&) {}, [&](const syntax::Unary& unary) { read(*unary.operand); },
              [&](const syntax::Binary& binary) {
                read(*binary.left);
                read(*binary.right);
              },
              [&](const syntax::Call& call) { read(call.arguments); },
              [&](const syntax::Parameter& parameter) { read(parameter); },
              [&](const syntax::Variable& variable) { read(variable); },
              [&](const syntax::CycleParameter& cycle) { read(*cycle.number); },
              // EXIST and SIZEOF do not read the value.
              [](const syntax::Query&) {}},
        expression.node);
  }
  void read(const std::vector<syntax::Expression>& expressions) {
    for (const syntax::Expression& expression : expressions) {
      read(expression);
    }
  }
  void read(const syntax::Parameter& parameter) {
    if (parameter.index) {
      read(*parameter.index);
    }
    read(parameter.elements);
  }
  void read(const syntax::Variable& variable) {
    const std::string_view part = service_part(variable);
    if (part == "RESPONSE_STATE") {
      effects_.push_back({.kind = Kind::response_state_read, .shown = shown_});
    } else if (part == "RESPONSE") {
      effects_.push_back({.kind = Kind::response_read, .shown = shown_});
    } else if (!part.empty()) {
      reads_request_ = true;
    }
    for (const syntax::VariablePart& each : variable.parts) {
      read(each.elements);
    }
  }

  void assign(const syntax::Assignment& assignment) {
    read(assignment.value);
    const auto* const variable = std::get_if<syntax::Variable>(&assignment.target);
    if (variable == nullptr) {
      return;
    }
    const std::string_view part = service_part(*variable);
    const bool plain = !assignment.operation.has_value();
    if (part == "UUID" || part == "REQUEST") {
      effects_.push_back({.kind = part == "UUID" ? Kind::uuid : Kind::request,
                          .text = plain ? constant_text(assignment.value) : std::nullopt});
    } else if (part == "REQUEST_STATE") {
      effects_.push_back({.kind = Kind::request_state,
                          .number = plain ? constant_number(assignment.value) : std::nullopt});
    } else if (!part.empty()) {
      effects_.push_back({.kind = Kind::response_written, .text = std::string(part)});
    }
  }

  /// The values in a message.
  void show(const std::vector<syntax::Expression>& values) {
    shown_ = true;
    read(values);
    shown_ = false;
  }

  /// `values`: axis words of the block are values, not positions.
  void word(const syntax::Word& word, bool values) {
    read(word.value);
    if (word.argument) {
      read(*word.argument);
    }
    const auto number = constant_number(word.value);
    if (word.address == "G" && number && syntax::calls_subprogram(*number)) {
      effects_.push_back({.kind = Kind::configured_call});
    }
    if (word.address == "M" && number) {
      if (*number == 2 || *number == 30) {
        effects_.push_back({.kind = Kind::end});
      } else if (*number == 17 || *number == 29) {
        effects_.push_back({.kind = Kind::end_of_subprogram});
      }
      return;
    }
    if (is_axis(word.address) && !values) {
      effects_.push_back({.kind = Kind::motion});
    }
  }

  void words(const syntax::Words& words) {
    const bool values = std::ranges::any_of(words.items, [](const syntax::WordsItem& item) {
      const auto* const keyword = std::get_if<syntax::Word>(&item);
      const auto number = keyword != nullptr && keyword->address == "G"
                              ? constant_number(keyword->value)
                              : std::nullopt;
      return number && syntax::takes_values(*number);
    });
    for (const syntax::WordsItem& item : words.items) {
      std::visit(
          Cases{[&](const syntax::Word& keyword) { word(keyword, values); },
                [&](const syntax::Assignment& assignment) { assign(assignment); },
                [&](const syntax::DataAssignment& data_assignment) { read(data_assignment.value); },
                [&](const syntax::QueueMessage& queue_message) { read(queue_message.value); },
                [](const auto&) {}},
          item);
    }
  }

  void wait(const syntax::WaitFor& wait) {
    const std::size_t before = effects_.size();
    read(wait.condition);
    const auto reads = [&](Kind kind) {
      return std::any_of(effects_.begin() + static_cast<std::ptrdiff_t>(before), effects_.end(),
                         [kind](const Effect& effect) { return effect.kind == kind; });
    };
    const bool for_state = reads(Kind::response_state_read);
    // Its service has no states that mean anything.
    const bool for_text = !for_state && reads(Kind::response_read);
    effects_.resize(before);
    if (for_state || for_text) {
      effects_.push_back({.kind = Kind::wait,
                          .judged = for_text || asks_for_one_state(wait.condition),
                          .flaw = flaw_of(wait.condition)});
    } else if (reads_request_ || flaw_of(wait.condition) != Effect::Flaw::none) {
      effects_.push_back({.kind = Kind::wait, .flaw = Effect::Flaw::other_variable});
    }
  }

  void error(const syntax::UserError& error) {
    bool only_warns = false;
    for (const syntax::ErrorParameter& parameter : error.parameters) {
      read(parameter.value);
      only_warns |= parameter.name == "RC" && constant_number(parameter.value) == 0.0;
    }
    if (!only_warns) {
      effects_.push_back({.kind = Kind::end});
    }
  }

 private:
  static Effect::Flaw flaw_of(const syntax::Expression& condition) {
    constexpr auto rule = syntax::ConditionRule::above_half;
    if (truth_at(condition, rule, 0).value_or(false)) {
      return Effect::Flaw::over_at_once;
    }
    return can_be_true(condition, rule) ? Effect::Flaw::none : Effect::Flaw::never_over;
  }

  std::vector<Effect>& effects_;
  bool shown_ = false;
  bool reads_request_ = false;
};

}  // namespace

std::vector<Effect> effects_of(const syntax::Statement& statement) {
  std::vector<Effect> effects;
  Reader reader(effects);
  std::visit(Cases{[&](const syntax::Words& words) { reader.words(words); },
                   [&](const syntax::Branch& branch) { reader.read(branch.condition); },
                   [&](const syntax::For& loop) {
                     reader.read(loop.start);
                     reader.read(loop.end);
                   },
                   [&](const syntax::Switch& branch) { reader.read(branch.selector); },
                   [&](const syntax::Flush&) { effects.push_back({.kind = Kind::flush}); },
                   [&](const syntax::WaitFor& wait) { reader.wait(wait); },
                   [&](const syntax::Message& message) { reader.show(message.text.values); },
                   [&](const syntax::SaveMessage& message) { reader.show(message.text.values); },
                   [&](const syntax::CycleCall& call) {
                     for (const syntax::CycleArgument& argument : call.arguments) {
                       reader.read(argument.value);
                     }
                   },
                   [&](const syntax::Declarations& declarations) {
                     for (const syntax::Declaration& declaration : declarations.variables) {
                       reader.read(declaration.initial);
                     }
                   },
                   [&](const syntax::UserError& error) { reader.error(error); },
                   [&](const syntax::Skipped& skipped) {
                     if (skipped.flushes) {
                       effects.push_back({.kind = Kind::flush});
                     }
                   },
                   [](const auto&) {}},
             statement);
  return effects;
}

bool asks_for_one_state(const syntax::Expression& condition) {
  const auto* const binary = std::get_if<syntax::Binary>(&condition.node);
  if (binary == nullptr || binary->operation != BinaryOperator::equal) {
    return false;
  }
  const bool left = is_state(*binary->left);
  const auto number = constant_number(left ? *binary->right : *binary->left);
  return (left || is_state(*binary->right)) && number && *number != 0;
}

std::optional<std::string> constant_text(const syntax::Expression& expression) {
  if (const auto* const text = std::get_if<syntax::Text>(&expression.node)) {
    return text->text;
  }
  const auto* const binary = std::get_if<syntax::Binary>(&expression.node);
  if (binary == nullptr || binary->operation != BinaryOperator::add) {
    return std::nullopt;
  }
  auto left = constant_text(*binary->left);
  const auto right = constant_text(*binary->right);
  return left && right ? std::optional(*left + *right) : std::nullopt;
}

std::optional<double> constant_number(const syntax::Expression& expression) {
  if (const auto* const number = std::get_if<syntax::Number>(&expression.node)) {
    return number->value;
  }
  const auto* const unary = std::get_if<syntax::Unary>(&expression.node);
  if (unary == nullptr || unary->operation != syntax::UnaryOperator::minus) {
    return std::nullopt;
  }
  const auto value = constant_number(*unary->operand);
  return value ? std::optional(-*value) : std::nullopt;
}

}  // namespace millrace::tools::lint
