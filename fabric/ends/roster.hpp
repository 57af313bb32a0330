// Who is there: what discovery and beats say goes into a registry, and a timer rings when somebody
// has been silent for too long. For the ends that want to know of instances.
//
//   Roster roster(executor, {.drain_beats = …, .announce = …});
//   roster.open(participant, weak_from_this(), on_endpoint, on_beat);   // who posts for them
//   roster.look_around();                                   // in the turn that on_endpoint posts
//   while (roster.take_beats([&](writer, load, is_theirs, at) { … })) {}      // in that of on_beat
//   for (const InstanceId& instance : roster.changes().gone) …               // after either
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/dds/badges.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/ends/discovery.hpp"
#include "fabric/registry/registry.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::ends {

/// To be used on one executor, which runs one thing at a time.
class Roster {
 public:
  /// What its owner does when it is to be seen who has fallen silent.
  struct Owner {
    /// Takes the beats that have come: while this process stood still it heard nobody, and what has
    /// come since is not silence.
    std::function<void()> drain_beats;
    /// Tells of changes().
    std::function<void()> announce;
  };

  Roster(const boost::asio::any_io_executor& executor, Owner owner)
      : owner_(std::move(owner)), silence_(executor) {}
  Roster(const Roster&) = delete;
  Roster& operator=(const Roster&) = delete;

  /// Throws std::runtime_error with Cyclone's reason. `alive` sees the owner gone; `on_endpoint`
  /// and `on_beat` outlive what is opened here, which close() ends.
  void open(const dds::Participant& participant, std::weak_ptr<void> alive,
            dds::PostOnce& on_endpoint, dds::PostOnce& on_beat);
  void close();

  /// Takes in what discovery and badges have told since.
  Discovery::News look_around();

  /// Takes a batch of beats and calls use(writer, load, is_theirs, at) for what each says of an
  /// instance: `is_theirs` if that instance is of the process that beats. False if there was none.
  template <typename Use>
  bool take_beats(Use use);

  /// What is different since the last call; sets the timer.
  registry::Registry::Changes changes();

  [[nodiscard]] registry::Registry& registry() { return registry_; }

 private:
  void look_at_badges(Discovery::News& news);
  void await_silence();
  void on_silence(SteadyTime due);

  Owner owner_;
  std::weak_ptr<void> alive_;
  registry::Registry registry_;
  std::optional<Discovery> discovery_;
  std::optional<wire::Reader<Beat>> beats_;
  /// Who beats for ever new processes, until it was told.
  std::optional<std::string> flooding_;
  /// Null without trust.
  dds::Badges* badges_ = nullptr;
  std::optional<dds::Badges::Watcher> proofs_;
  dds::PostOnce* on_endpoint_ = nullptr;
  boost::asio::steady_timer silence_;
  std::optional<SteadyTime> silence_at_;
};

template <typename Use>
bool Roster::take_beats(Use use) {
  if (!beats_) {
    return false;
  }
  const auto batch = beats_->take();
  if (auto flood = beats_->take_flooding()) {
    flooding_ = *std::move(flood);
    on_endpoint_->post();
  }
  const SteadyTime at = std::chrono::steady_clock::now();
  for (const wire::Taken<Beat>& taken : batch) {
    // Of a process that nobody knows yet it may be the first, and is followed by the next one.
    if (!taken.valid || !registry_.beat(taken.writer, at)) {
      continue;
    }
    for (const InstanceLoad& load : taken.value.loads) {
      use(taken.writer, load, registry_.beats_for(taken.writer, load.status.instance), at);
    }
  }
  return !batch.empty();
}

}  // namespace millrace::fabric::ends
