#include "tools/lint/control_flow.hpp"

#include <algorithm>
#include <string>
#include <variant>

#include "cnc/nc/characters.hpp"
#include "fabric/cases.hpp"
#include "tools/lint/effects.hpp"

namespace millrace::tools::lint {

namespace {

namespace syntax = cnc::nc::syntax;
using fabric::Cases;

/// All possible targets, for a jump whose target is computed at run time.
std::vector<std::size_t> all_targets(const syntax::Routine& routine) {
  std::vector<std::size_t> all;
  all.reserve(routine.numbers.size() + routine.labels.size());
  for (const auto& [number, operation] : routine.numbers) {
    all.push_back(operation);
  }
  for (const auto& [label, operation] : routine.labels) {
    all.push_back(operation);
  }
  return all;
}

std::vector<std::size_t> targets_of(const syntax::Goto& jump, const syntax::Routine& routine) {
  if (const auto* const number = std::get_if<syntax::Expression>(&jump.target)) {
    if (const auto constant = constant_number(*number)) {
      const auto found = routine.numbers.find(static_cast<long>(*constant));
      return found == routine.numbers.end() ? std::vector<std::size_t>{}
                                            : std::vector<std::size_t>{found->second};
    }
  } else if (const auto* const label =
                 std::get_if<std::string>(&std::get<syntax::Name>(jump.target))) {
    const auto found = routine.labels.find(cnc::nc::upper(*label));
    return found == routine.labels.end() ? std::vector<std::size_t>{}
                                         : std::vector<std::size_t>{found->second};
  }
  return all_targets(routine);
}

std::vector<std::size_t> successors(const syntax::Routine& routine, std::size_t at) {
  const std::size_t next = at + 1;
  return std::visit(Cases{[](const syntax::Jump& jump) { return std::vector{jump.target}; },
                          [&](const syntax::Branch& branch) {
                            return std::vector{next, branch.target};
                          },
                          [&](const syntax::For& loop) {
                            return std::vector{next, loop.exit};
                          },
                          [&](const syntax::EndFor& end) {
                            const auto& loop =
                                std::get<syntax::For>(routine.operations[end.loop].statement);
                            return std::vector{end.loop + 1, loop.exit};
                          },
                          [](const syntax::Switch& branch) {
                            std::vector<std::size_t> targets{branch.otherwise};
                            for (const syntax::SwitchCase& each : branch.cases) {
                              targets.push_back(each.target);
                            }
                            return targets;
                          },
                          [&](const syntax::Goto& jump) { return targets_of(jump, routine); },
                          [&](const auto&) { return std::vector{next}; }},
                    routine.operations[at].statement);
}

}  // namespace

ControlFlow::ControlFlow(const syntax::Routine& routine) {
  behind_.reserve(routine.operations.size());
  for (std::size_t at = 0; at < routine.operations.size(); ++at) {
    behind_.push_back(successors(routine, at));
    const syntax::Statement& statement = routine.operations[at].statement;
    jumps_.push_back(behind_.back().size() == 1 &&
                     (std::holds_alternative<syntax::Jump>(statement) ||
                      std::holds_alternative<syntax::Goto>(statement)));
    for (const std::size_t target : behind_.back()) {
      if (target <= at) {
        loops_.push_back({target, at});
      }
    }
  }
  std::ranges::stable_sort(loops_, {}, [](const Loop& loop) { return loop.last - loop.first; });
}

bool ControlFlow::leaves(const Loop& loop, std::size_t operation) const {
  // A jump backwards begins the next iteration, so this ends.
  while (loop.has(operation) && jumps_[operation] && behind_[operation].front() > operation) {
    operation = behind_[operation].front();
  }
  return !loop.has(operation);
}

const Loop* ControlFlow::innermost(std::size_t operation) const {
  const auto found =
      std::ranges::find_if(loops_, [&](const Loop& loop) { return loop.has(operation); });
  return found == loops_.end() ? nullptr : &*found;
}

}  // namespace millrace::tools::lint
