// Which writer's samples of a key count where DDS lets every participant write it: those of the
// first writer, until it is gone or another one ranks before it. Pure.
//
//   KeyOwners<ChannelKey, ChannelStatus> channels;
//   if (channels.update(key, writer, status, rank)) …         // its word counts
//   for (const ChannelKey& key : channels.rank_again(rank)) …   // channels.find(key) is another one now
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace millrace::fabric {

template <typename Key, typename Value>
class KeyOwners {
 public:
  /// Cyclone's instance handle of a writer; none is used twice.
  using Handle = std::uint64_t;
  /// The last sample of a writer.
  struct Sample {
    Handle writer = 0;
    Value value{};
  };
  /// Far more than a fabric has. For further keys every writer's samples count.
  static constexpr std::size_t most_keys = 65'536;
  static constexpr std::size_t most_writers = 8;

  /// True if the word of `writer` counts. `rank(key, word)`: the lowest one counts, of equal ones
  /// the one that counted before.
  template <typename Rank>
  bool update(const Key& key, Handle writer, Value value, const Rank& rank) {
    auto known = samples_.find(key);
    if (known == samples_.end()) {
      if (samples_.size() >= most_keys) {
        return true;
      }
      known = samples_.try_emplace(key).first;
    }
    std::vector<Sample>& samples = known->second;
    const auto sample = std::ranges::find(samples, writer, &Sample::writer);
    if (sample == samples.end()) {
      samples.push_back({writer, std::move(value)});
    } else {
      sample->value = std::move(value);
    }
    put_first(key, samples, rank);
    const bool counts = samples.front().writer == writer;
    if (samples.size() > most_writers) {
      samples.pop_back();
    }
    return counts;
  }

  /// The effective sample; nullptr if there is none.
  [[nodiscard]] Sample* find(const Key& key) {
    const auto known = samples_.find(key);
    return known == samples_.end() ? nullptr : &known->second.front();
  }

  /// The ranks have changed. Returns the keys whose effective sample is now another one.
  template <typename Rank>
  std::vector<Key> rank_again(const Rank& rank) {
    std::vector<Key> changed;
    for (auto& [key, samples] : samples_) {
      if (put_first(key, samples, rank)) {
        changed.push_back(key);
      }
    }
    return changed;
  }

  /// Returns the keys whose effective sample was removed.
  template <typename IsGone>
  std::vector<Key> forget(const IsGone& is_gone) {
    std::vector<Key> changed;
    for (auto& [key, samples] : samples_) {
      if (is_gone(samples.front().writer)) {
        changed.push_back(key);
      }
      std::erase_if(samples, [&](const Sample& sample) { return is_gone(sample.writer); });
    }
    std::erase_if(samples_, [](const auto& samples) { return samples.second.empty(); });
    return changed;
  }
  void forget(const Key& key) { samples_.erase(key); }

  /// Calls `use` with each key and its effective sample, in order from `key` on, while it returns
  /// true.
  template <typename Use>
  void each_from(const Key& key, const Use& use) {
    for (auto sample = samples_.lower_bound(key); sample != samples_.end(); ++sample) {
      if (!use(sample->first, sample->second.front())) {
        return;
      }
    }
  }

 private:
  template <typename Rank>
  static bool put_first(const Key& key, std::vector<Sample>& samples, const Rank& rank) {
    if (samples.size() < 2) {
      return false;
    }
    const auto best = std::ranges::min_element(
        samples, {}, [&](const Sample& sample) { return rank(key, sample); });
    const bool changes = best != samples.begin();
    std::rotate(samples.begin(), best, best + 1);
    return changes;
  }

  /// Of each key the effective sample first.
  std::map<Key, std::vector<Sample>> samples_;
};

}  // namespace millrace::fabric
