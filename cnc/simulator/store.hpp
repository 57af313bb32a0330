// All variables of one channel outside the NC interpreter, found by name or by number.
//
//   Store store;
//   store.family(Kind::global).add(std::make_shared<Variable>(…));
//   auto found = store.find("V.G.SERVICE.UUID");
//   found->variable->value(*found->element);
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator {

/// The families that an ADS client can enumerate, in the order of an enumeration of all three
/// (IB/tf5200_ads_access_to_cnc/312795019 has the names; the order is our choice).
enum class Kind { external, global, axis };
inline constexpr std::array<Kind, 3> all_kinds{Kind::external, Kind::global, Kind::axis};

/// "V.E", "V.G" or "V.A".
std::string_view prefix_of(Kind kind);

/// The variables of one kind, numbered without gaps in the order in which they were added.
class Family {
 public:
  /// The stores of several channels may share a variable. Its name must be new in this family.
  void add(std::shared_ptr<Variable> variable);
  [[nodiscard]] std::size_t size() const { return variables_.size(); }
  [[nodiscard]] Variable& at(std::size_t index) const { return *variables_.at(index); }
  /// The count of the old functions: consecutive variables that differ only in their axis count as
  /// one.
  [[nodiscard]] std::size_t listed() const { return listed_.size(); }
  /// The first variable of an entry.
  [[nodiscard]] Variable& listed_at(std::size_t index) const { return at(listed_.at(index)); }
  /// By full name without indices; null if there is none.
  [[nodiscard]] Variable* find(std::string_view base) const;
  [[nodiscard]] std::optional<std::size_t> index_of(std::string_view base) const;

 private:
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const {
      return std::hash<std::string_view>()(text);
    }
  };
  std::vector<std::shared_ptr<Variable>> variables_;
  std::vector<std::size_t> listed_;
  std::unordered_map<std::string, std::size_t, Hash, std::equal_to<>> by_name_;
};

/// A variable, and the selected element.
struct Selection {
  Variable* variable = nullptr;
  /// Nullopt: the whole array.
  std::optional<std::uint32_t> element;

  [[nodiscard]] ads::Bytes read() const;
  ads::Result<void> write(ads::BytesView bytes) const;
};

class Store {
 public:
  [[nodiscard]] Family& family(Kind kind) { return families_.at(static_cast<std::size_t>(kind)); }
  [[nodiscard]] const Family& family(Kind kind) const {
    return families_.at(static_cast<std::size_t>(kind));
  }

  /// Finds a variable by name, with indices for an element of an array. Names are case-sensitive
  /// (documented for V.E., IB/tf5200_external_variables/112455051; inferred for the others).
  [[nodiscard]] std::optional<Selection> find(std::string_view name) const;

  /// A number that does not change during the life of this store (its structure is our choice).
  [[nodiscard]] std::optional<std::uint32_t> handle(std::string_view base) const;
  /// Finds a variable by handle; without indices, the scalar or the whole array.
  [[nodiscard]] std::optional<Selection> find(std::uint32_t handle,
                                              std::span<const std::uint32_t> indices) const;

 private:
  std::array<Family, all_kinds.size()> families_;
};

}  // namespace millrace::cnc::simulator
