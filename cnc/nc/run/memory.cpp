#include "cnc/nc/run/memory.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

struct FamilyRule {
  std::string_view prefix;
  VariableFamily family;
};
constexpr std::array<FamilyRule, 5> families = {{{"V.P.", VariableFamily::program},
                                                 {"V.L.", VariableFamily::local},
                                                 {"V.S.", VariableFamily::self},
                                                 {"V.CYC.", VariableFamily::cycle},
                                                 {"P", VariableFamily::parameter}}};

Result<void> missing(std::string_view name) {
  return fault(0, std::string(name) + " does not exist; declare it between #VAR and #ENDVAR");
}

}  // namespace

Memory::Memory() : levels_(1) {}

void Memory::start_program() {
  parameters_.clear();
  program_.clear();
  levels_.clear();
  levels_.emplace_back();
}

void Memory::enter_level(std::optional<CycleArguments> arguments) {
  levels_.emplace_back();
  levels_.back().arguments = std::move(arguments);
}

void Memory::leave_level() {
  if (levels_.size() > 1) {
    levels_.pop_back();
  }
}

std::optional<VariableFamily> Memory::family_of(std::string_view name) {
  const auto rule = std::find_if(families.begin(), families.end(), [&](const FamilyRule& entry) {
    return name.starts_with(entry.prefix);
  });
  return rule == families.end() ? std::nullopt : std::optional(rule->family);
}

bool Memory::owns(std::string_view name) {
  return family_of(name).has_value();
}

const VariableTable& Memory::table_of(VariableFamily family, std::string_view name) const {
  switch (family) {
    case VariableFamily::parameter:
      return parameters_;
    case VariableFamily::program:
      return program_;
    case VariableFamily::self:
      return self_;
    case VariableFamily::local:
      return levels_.back().locals;
    default:
      break;
  }
  const auto level = std::find_if(levels_.rbegin(), levels_.rend(), [&](const Level& candidate) {
    return candidate.cycle.find(name).has_value();
  });
  return level == levels_.rend() ? levels_.back().cycle : level->cycle;
}

VariableTable& Memory::table_of(VariableFamily family, std::string_view name) {
  return const_cast<VariableTable&>(std::as_const(*this).table_of(family, name));
}

Result<void> Memory::assign(std::string_view name, const Value& value) {
  const auto family = family_of(name);
  if (!family) {
    return missing(name);
  }
  VariableTable& table = table_of(*family, name);
  const bool creates = *family == VariableFamily::parameter || *family == VariableFamily::program ||
                       *family == VariableFamily::self;
  if (table.find(name)) {
    return table.write(name, value);
  }
  if (!creates || name.ends_with(']')) {
    return missing(name);
  }
  // The first value creates the variable: as a string if it is one, otherwise as a number.
  VariableShape shape;
  if (std::holds_alternative<std::string>(value) && *family != VariableFamily::parameter) {
    shape = {VariableType::string, longest_variable_string, {}};
  }
  return table.declare(std::string(name), shape, {&value, 1});
}

Result<void> Memory::declare(std::string_view name, const VariableShape& shape,
                             std::span<const Value> initial) {
  const auto family = family_of(name);
  if (!family) {
    return fault(0, std::string(name) + " cannot be declared; #VAR takes P, V.P, V.L, V.S, V.CYC");
  }
  VariableTable& table =
      *family == VariableFamily::cycle ? levels_.back().cycle : table_of(*family, name);
  return table.declare(std::string(name), shape, initial);
}

Result<void> Memory::erase(std::string_view name) {
  const auto family = family_of(name);
  if (!family || !table_of(*family, name).erase(name)) {
    return fault(0, "#DELETE: " + std::string(name) + " does not exist");
  }
  return {};
}

const Value* Memory::cycle_argument(long number) const {
  const auto level = std::find_if(levels_.rbegin(), levels_.rend(), [](const Level& candidate) {
    return candidate.arguments.has_value();
  });
  if (level == levels_.rend()) {
    return nullptr;
  }
  const auto argument = level->arguments->find(number);
  return argument == level->arguments->end() ? nullptr : &argument->second;
}

std::size_t Memory::count(VariableFamily family) const {
  return table_of(family, {}).size();
}

std::optional<VariableInfo> Memory::info(VariableFamily family, std::size_t index) const {
  return table_of(family, {}).info(index);
}

std::optional<VariableInfo> Memory::find(std::string_view name) const {
  const auto family = family_of(name);
  return family ? table_of(*family, name).find(name) : std::nullopt;
}

Result<Value> Memory::read(std::string_view name) const {
  const auto family = family_of(name);
  if (!family) {
    return fault(0, std::string(name) + " is not a variable of the program");
  }
  return table_of(*family, name).read(name);
}

Result<void> Memory::overwrite(std::string_view name, const Value& value) {
  const auto family = family_of(name);
  return family ? table_of(*family, name).write(name, value) : missing(name);
}

bool Memory::exists(std::string_view name) const {
  const auto family = family_of(name);
  return family && table_of(*family, name).contains(name);
}

}  // namespace millrace::cnc::nc::run
