// A map with a limit: a new entry displaces the one that was unused for longest. Pure.
//
//   Recent<InstanceId, Command> commands(1024);
//   commands.put(command.id, command);
//   if (Command* known = commands.use(id)) …            // it is now the last one to go
//   if (const Command* known = commands.find(id)) …     // it keeps its age
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <variant>

namespace millrace::base {

/// Searched by a hash if there is one, otherwise in a tree.
template <typename Key, typename Value = std::monostate, typename Hash = void>
class Recent {
 public:
  struct Entry {
    Key key;
    Value value;
  };

  /// `most` ≥ 1 entries.
  explicit Recent(std::size_t most) : most_(most) {}
  Recent(Recent&&) noexcept = default;
  Recent& operator=(Recent&&) noexcept = default;

  /// The entry of `key` has this value, and is the newest. Returns the displaced entry.
  std::optional<Entry> put(const Key& key, Value value = {}) {
    if (Value* const known = use(key)) {
      *known = std::move(value);
      return std::nullopt;
    }
    places_.emplace(key, entries_.insert(entries_.end(), Entry{key, std::move(value)}));
    if (places_.size() <= most_) {
      return std::nullopt;
    }
    std::optional<Entry> oldest(std::move(entries_.front()));
    erase(oldest->key);
    return oldest;
  }
  /// Makes it the newest; null if there is none.
  Value* use(const Key& key) {
    const auto known = places_.find(key);
    if (known == places_.end()) {
      return nullptr;
    }
    entries_.splice(entries_.end(), entries_, known->second);
    return &known->second->value;
  }
  [[nodiscard]] Value* find(const Key& key) {
    const auto known = places_.find(key);
    return known == places_.end() ? nullptr : &known->second->value;
  }
  [[nodiscard]] const Value* find(const Key& key) const {
    const auto known = places_.find(key);
    return known == places_.end() ? nullptr : &known->second->value;
  }
  [[nodiscard]] bool contains(const Key& key) const { return places_.contains(key); }
  Value& newest() { return entries_.back().value; }

  void erase(const Key& key) {
    if (const auto known = places_.find(key); known != places_.end()) {
      const auto entry = known->second;
      places_.erase(known);
      entries_.erase(entry);
    }
  }
  template <typename If>
  void erase_if(const If& is_gone) {
    std::erase_if(places_, [&](const auto& place) {
      const bool gone = is_gone(*place.second);
      if (gone) {
        entries_.erase(place.second);
      }
      return gone;
    });
  }
  void clear() {
    places_.clear();
    entries_.clear();
  }

  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// The oldest first.
  auto begin() { return entries_.begin(); }
  auto end() { return entries_.end(); }
  [[nodiscard]] auto begin() const { return entries_.begin(); }
  [[nodiscard]] auto end() const { return entries_.end(); }

 private:
  using Entries = std::list<Entry>;
  using Place = typename Entries::iterator;
  using Places = std::conditional_t<std::is_void_v<Hash>, std::map<Key, Place>,
                                    std::unordered_map<Key, Place, Hash>>;

  std::size_t most_;
  Entries entries_;
  Places places_;
};

}  // namespace millrace::base
