// Limits the keys that a reader keeps of each writer: Cyclone keeps about 0.6 kB for each key until
// it has no writer any more, and a stranger can invent any number.
//
//   KeyLimit limit(4);                     // outlives the topic, and is not moved
//   limit.watch(topic);                    // before the reader is created
//   limit.listen(listener);                // of the reader: names writers, also those that leave
//   if (auto writer = limit.take_flooding()) …
//   const auto before = limit.admitted();
//   for (…) if (instance_state_of(info) == InstanceState::no_writers) limit.forget(key, before);  // taken since
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "base/recent.hpp"
#include "fabric/dds/entity.hpp"

namespace millrace::fabric::wire {

class KeyLimit {
 public:
  /// Far more than a fabric has. Beyond that the one that was silent for longest is removed, with
  /// its keys.
  static constexpr std::size_t most_writers = 4'096;

  /// `most` keys of each writer.
  explicit KeyLimit(std::size_t most) : most_(most) {}
  KeyLimit(const KeyLimit&) = delete;
  KeyLimit& operator=(const KeyLimit&) = delete;

  [[nodiscard]] std::size_t most() const { return most_; }

  /// Drops samples of further keys before Cyclone stores anything of them. For a topic entity of
  /// this reader alone.
  void watch(const dds::Entity& topic);
  /// Whether a sample of this key is to be kept. In Cyclone's threads.
  bool admits(dds_instance_handle_t writer, dds_instance_handle_t key);
  /// Number of samples that were admitted so far.
  [[nodiscard]] std::uint64_t admitted() const {
    const std::lock_guard guard(lock_);
    return admitted_;
  }
  /// A sample that was taken after `before` shows that this key has no writer any more. Ignored if
  /// a sample of it was admitted since: Cyclone still keeps that one.
  void forget(dds_instance_handle_t key, std::uint64_t before);
  /// A writer whose samples were dropped and that was not returned since; call it until it returns
  /// none.
  std::optional<dds_instance_handle_t> take_flooding();

  /// Makes `listener`, of a reader, remember the DDS names of the participants of its writers.
  void listen(dds_listener_t* listener);
  /// The name of a writer that is or lately was matched; empty if it is unknown.
  [[nodiscard]] std::string name_of(dds_instance_handle_t writer) const;

 private:
  const std::size_t most_;
  mutable std::mutex lock_;
  std::uint64_t admitted_ = 0;
  /// By writer: each key, and the number of its last admitted sample.
  base::Recent<dds_instance_handle_t, std::unordered_map<dds_instance_handle_t, std::uint64_t>,
               std::hash<dds_instance_handle_t>>
      keys_{most_writers};
  /// Those that take_flooding() returns; further ones are reported at their next sample.
  static constexpr std::size_t most_flooding = 64;
  std::set<dds_instance_handle_t> flooding_;
  base::Recent<dds_instance_handle_t, std::string, std::hash<dds_instance_handle_t>> names_{
      most_writers};
};

}  // namespace millrace::fabric::wire
