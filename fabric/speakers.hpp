// Whose word on a key counts where DDS lets every participant write it: that of the first writer,
// until it is gone or another one ranks before it. Pure.
//
//   Speakers<ChannelKey, ChannelStatus> channels;
//   if (channels.said(key, writer, status, rank)) …         // its word counts
//   for (const ChannelKey& key : channels.settle(rank)) …   // channels.find(key) is another one now
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace millrace::fabric {

template <typename Key, typename Value>
class Speakers {
 public:
  /// Cyclone's instance handle of a writer; none is used twice.
  using Handle = std::uint64_t;
  /// What a writer has said last.
  struct Word {
    Handle writer = 0;
    Value value{};
  };
  /// Far more than a fabric has. The word of any writer counts for further keys.
  static constexpr std::size_t most_keys = 65'536;
  static constexpr std::size_t most_writers = 8;

  /// True if the word of `writer` counts. `rank(key, word)`: the lowest one counts, of equal ones
  /// the one that counted before.
  template <typename Rank>
  bool said(const Key& key, Handle writer, Value value, const Rank& rank) {
    auto known = words_.find(key);
    if (known == words_.end()) {
      if (words_.size() >= most_keys) {
        return true;
      }
      known = words_.try_emplace(key).first;
    }
    std::vector<Word>& words = known->second;
    const auto word = std::ranges::find(words, writer, &Word::writer);
    if (word == words.end()) {
      words.push_back({writer, std::move(value)});
    } else {
      word->value = std::move(value);
    }
    put_first(key, words, rank);
    const bool counts = words.front().writer == writer;
    if (words.size() > most_writers) {
      words.pop_back();
    }
    return counts;
  }

  /// The word that counts; nullptr if nothing was said.
  [[nodiscard]] Word* find(const Key& key) {
    const auto known = words_.find(key);
    return known == words_.end() ? nullptr : &known->second.front();
  }

  /// The ranks have changed. Returns the keys of which another word counts now.
  template <typename Rank>
  std::vector<Key> settle(const Rank& rank) {
    std::vector<Key> changed;
    for (auto& [key, words] : words_) {
      if (put_first(key, words, rank)) {
        changed.push_back(key);
      }
    }
    return changed;
  }

  /// Returns the keys of which the word that counted is forgotten.
  template <typename IsGone>
  std::vector<Key> forget(const IsGone& is_gone) {
    std::vector<Key> changed;
    for (auto& [key, words] : words_) {
      if (is_gone(words.front().writer)) {
        changed.push_back(key);
      }
      std::erase_if(words, [&](const Word& word) { return is_gone(word.writer); });
    }
    std::erase_if(words_, [](const auto& one) { return one.second.empty(); });
    return changed;
  }
  void forget(const Key& key) { words_.erase(key); }

  /// Each key with the word that counts, in their order from `key` on, while `use` says so.
  template <typename Use>
  void each_from(const Key& key, const Use& use) {
    for (auto one = words_.lower_bound(key); one != words_.end(); ++one) {
      if (!use(one->first, one->second.front())) {
        return;
      }
    }
  }

 private:
  template <typename Rank>
  static bool put_first(const Key& key, std::vector<Word>& words, const Rank& rank) {
    if (words.size() < 2) {
      return false;
    }
    const auto best =
        std::ranges::min_element(words, {}, [&](const Word& word) { return rank(key, word); });
    const bool changes = best != words.begin();
    std::rotate(words.begin(), best, best + 1);
    return changes;
  }

  /// Of each key the word that counts in front.
  std::map<Key, std::vector<Word>> words_;
};

}  // namespace millrace::fabric
