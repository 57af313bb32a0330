#include "cnc/simulator/store.hpp"

#include <cassert>

#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator {

namespace {

/// The upper byte of a handle is the kind, from 1; the lower bytes are the index.
constexpr unsigned kind_shift = 24;
constexpr std::uint32_t index_mask = (1U << kind_shift) - 1;

std::optional<Kind> kind_of(std::string_view name) {
  for (const Kind kind : all_kinds) {
    const std::string_view prefix = prefix_of(kind);
    if (name.starts_with(prefix) && name.substr(prefix.size()).starts_with('.')) {
      return kind;
    }
  }
  return std::nullopt;
}

/// Counts row by row; nullopt for too many, too few or too large indices.
std::optional<std::uint32_t> element_at(const Declaration& declaration,
                                        std::span<const std::uint32_t> indices) {
  if (indices.size() != declaration.dimensions.size()) {
    return std::nullopt;
  }
  std::uint32_t element = 0;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= declaration.dimensions[i]) {
      return std::nullopt;
    }
    element = element * declaration.dimensions[i] + indices[i];
  }
  return element;
}

std::optional<Selection> select(Variable& variable, std::span<const std::uint32_t> indices) {
  if (indices.empty() && !variable.declaration().dimensions.empty()) {
    return Selection{&variable, std::nullopt};
  }
  const auto element = element_at(variable.declaration(), indices);
  if (!element) {
    return std::nullopt;
  }
  return Selection{&variable, element};
}

}  // namespace

std::string_view prefix_of(Kind kind) {
  switch (kind) {
    case Kind::external:
      return "V.E";
    case Kind::global:
      return "V.G";
    case Kind::axis:
      break;
  }
  return "V.A";
}

void Family::add(std::shared_ptr<Variable> variable) {
  const auto [place, is_new] = by_name_.emplace(variable->declaration().name, variables_.size());
  assert(is_new);
  const Declaration& declaration = variable->declaration();
  const bool of_the_last =
      declaration.axis > 0 && !listed_.empty() &&
      listed_at(listed_.size() - 1).declaration().axis > 0 &&
      listed_at(listed_.size() - 1).declaration().listed() == declaration.listed();
  if (!of_the_last) {
    listed_.push_back(variables_.size());
  }
  variables_.push_back(std::move(variable));
}

Variable* Family::find(std::string_view base) const {
  const auto index = index_of(base);
  return index ? variables_[*index].get() : nullptr;
}

std::optional<std::size_t> Family::index_of(std::string_view base) const {
  const auto found = by_name_.find(base);
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

ads::Bytes Selection::read() const {
  return element ? variable->bytes(*element) : variable->all_bytes();
}

ads::Result<void> Selection::write(ads::BytesView bytes) const {
  return element ? variable->write(*element, bytes) : variable->write_all(bytes);
}

std::optional<Selection> Store::find(std::string_view name) const {
  const auto parsed = VariableName::parse(name);
  const auto kind = kind_of(name);
  if (!parsed || !kind) {
    return std::nullopt;
  }
  Variable* variable = family(*kind).find(parsed->base);
  const bool misplaced = variable != nullptr && !parsed->indices.empty() &&
                         parsed->behind != variable->declaration().behind;
  return variable == nullptr || misplaced ? std::nullopt : select(*variable, parsed->indices);
}

std::optional<std::uint32_t> Store::handle(std::string_view base) const {
  const auto kind = kind_of(base);
  const auto index = kind ? family(*kind).index_of(base) : std::nullopt;
  if (!index) {
    return std::nullopt;
  }
  return ((static_cast<std::uint32_t>(*kind) + 1) << kind_shift) |
         static_cast<std::uint32_t>(*index);
}

std::optional<Selection> Store::find(std::uint32_t handle,
                                     std::span<const std::uint32_t> indices) const {
  const std::uint32_t kind = (handle >> kind_shift) - 1;
  const std::uint32_t index = handle & index_mask;
  if (kind >= families_.size() || index >= families_[kind].size()) {
    return std::nullopt;
  }
  return select(families_[kind].at(index), indices);
}

}  // namespace millrace::cnc::simulator
