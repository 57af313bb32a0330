#include "fabric/dds/badges.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <unordered_map>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <pthread.h>

#include "base/program/barrier.hpp"
#include "fabric/complaints.hpp"
#include "idl/badge.h"

namespace millrace::fabric::dds {

namespace {

using namespace std::chrono_literals;
using Handle = dds_instance_handle_t;

/// Far more programs and writers than leave before their last words are taken.
constexpr std::size_t most_departed = 1024;

/// How soon a change of the list is seen.
constexpr auto look_every = 1s;
/// Who has been told that his own certificate is over is told again.
constexpr auto tell_again = 15s;

struct EndpointDeleter {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const {
    dds_builtintopic_free_endpoint(endpoint);
  }
};
using Endpoint = std::unique_ptr<dds_builtintopic_endpoint_t, EndpointDeleter>;

std::vector<std::string> partitions_of(const dds_qos_t* qos) {
  std::uint32_t count = 0;
  char** names = nullptr;
  std::vector<std::string> all;
  if (dds_qget_partition(qos, &count, &names)) {
    for (std::uint32_t i = 0; i < count; ++i) {
      all.emplace_back(names[i]);
      dds_free(names[i]);
    }
    dds_free(static_cast<void*>(names));
  }
  return all;
}

/// Neither reliable nor kept: there is nothing to keep.
Qos badge_qos() {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  return qos;
}

/// Of a publisher or subscriber.
Qos partitions_qos(const std::vector<std::string>& partitions) {
  std::vector<const char*> names;
  names.reserve(partitions.size());
  for (const std::string& partition : partitions) {
    names.push_back(partition.c_str());
  }
  Qos qos(dds_create_qos());
  dds_qset_partition(qos.get(), static_cast<std::uint32_t>(names.size()), names.data());
  return qos;
}

}  // namespace

struct Badges::Impl {
  Impl(std::string own_fabric, std::shared_ptr<const Trust> own_trust)
      : fabric(std::move(own_fabric)), trust(std::move(own_trust)) {}
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void open(dds_entity_t participant);
  void watch();
  void look_whom_to_believe();
  void look_at_our_own(std::chrono::steady_clock::time_point now);

  // In Cyclone's threads.
  void on_badge(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;
  void on_writer(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;

  // Under the lock.
  [[nodiscard]] Proof proof_of(Handle participant) const;
  void put_on(Handle writer, Handle participant, Badge badge);
  void take_off(Handle writer);
  void tell(Handle participant);

  void wake();

  struct Worn {
    std::shared_ptr<const Badge> badge;
    bool there = true;
  };
  struct Seen {
    Handle participant;
    /// With how many readers of ours.
    std::size_t matched = 0;
  };

  const std::string fabric;
  const std::shared_ptr<const Trust> trust;

  mutable std::mutex lock;
  /// Writers of badges, and whose they are.
  std::unordered_map<Handle, Handle> badges;
  std::unordered_map<Handle, Worn> worn;
  std::unordered_map<Handle, Seen> writers;
  /// The first to be forgotten in front.
  std::deque<Handle> left;
  std::deque<Handle> left_writers;
  std::set<std::string> revoked;
  Complaints complaints;
  std::vector<std::string> said;

  /// Taken before `lock`, if both are.
  std::mutex watchers_lock;
  std::vector<Watcher*> watchers;

  std::string trouble;
  std::optional<std::chrono::steady_clock::time_point> ended_at;
  std::mutex end_lock;
  std::condition_variable end_news;
  bool ending = false;
  std::thread thread;

  Entity topic;
  Entity subscriber;
  Entity reader;
  Entity publisher;
  Entity writer;
};

Badges::Impl::~Impl() {
  {
    const std::lock_guard guard(end_lock);
    ending = true;
  }
  end_news.notify_all();
  if (thread.joinable()) {
    thread.join();
  }
  // No listener runs from here on.
  reader.reset();
}

void Badges::Impl::open(dds_entity_t participant) {
  topic = Entity(
      check(dds_create_topic(participant, &millrace_Badge_desc, badge_topic_name, nullptr, nullptr),
            fmt::format("create the topic {}", badge_topic_name)));
  const std::string theirs = all_badges(fabric);
  subscriber =
      Entity(check(dds_create_subscriber(participant, partitions_qos({theirs}).get(), nullptr),
                   fmt::format("subscribe to {}", theirs)));
  const Listener on_match(dds_create_listener(nullptr));
  dds_lset_subscription_matched_arg(
      on_match.get(),
      [](dds_entity_t own, dds_subscription_matched_status_t status, void* self) noexcept {
        static_cast<Impl*>(self)->on_badge(own, status);
      },
      this, true);
  reader = Entity(check(
      dds_create_reader(subscriber.handle(), topic.handle(), badge_qos().get(), on_match.get()),
      fmt::format("read {} in {}", badge_topic_name, theirs)));
  publisher =
      Entity(check(dds_create_publisher(participant, partitions_qos(trust->badge).get(), nullptr),
                   "publish a badge"));
  writer = Entity(
      check(dds_create_writer(publisher.handle(), topic.handle(), badge_qos().get(), nullptr),
            fmt::format("write {} in {}", badge_topic_name, fmt::join(trust->badge, ", "))));
  look_whom_to_believe();
  thread = std::thread([this] { watch(); });
  ::pthread_setname_np(thread.native_handle(), "trust");
}

void Badges::Impl::on_badge(dds_entity_t own,
                            const dds_subscription_matched_status_t& status) noexcept {
  base::program::contain("noticing a badge", [&] {
    const Handle handle = status.last_publication_handle;
    if (status.current_count_change > 0) {
      const Endpoint endpoint(dds_get_matched_publication_data(own, handle));
      auto badge = endpoint ? parse_badge(fabric, partitions_of(endpoint->qos)) : std::nullopt;
      if (!badge) {
        return;
      }
      const std::lock_guard guard(lock);
      put_on(handle, endpoint->participant_instance_handle, *std::move(badge));
    } else if (status.current_count_change < 0) {
      const std::lock_guard guard(lock);
      take_off(handle);
    }
    wake();
  });
}

void Badges::Impl::on_writer(dds_entity_t own,
                             const dds_subscription_matched_status_t& status) noexcept {
  base::program::contain("noticing a writer", [&] {
    const Handle handle = status.last_publication_handle;
    if (status.current_count_change > 0) {
      const Endpoint endpoint(dds_get_matched_publication_data(own, handle));
      if (endpoint) {
        const std::lock_guard guard(lock);
        Seen& seen = writers[handle];
        seen.participant = endpoint->participant_instance_handle;
        ++seen.matched;
      }
      return;
    }
    const std::lock_guard guard(lock);
    const auto known = writers.find(handle);
    if (status.current_count_change == 0 || known == writers.end() || known->second.matched == 0 ||
        --known->second.matched > 0) {
      return;
    }
    left_writers.push_back(handle);
    if (left_writers.size() > most_departed) {
      const auto oldest = writers.find(left_writers.front());
      if (oldest != writers.end() && oldest->second.matched == 0) {
        writers.erase(oldest);
      }
      left_writers.pop_front();
    }
  });
}

void Badges::Impl::put_on(Handle handle, Handle participant, Badge badge) {
  badges.insert_or_assign(handle, participant);
  worn.insert_or_assign(participant, Worn{std::make_shared<const Badge>(std::move(badge))});
  tell(participant);
}

void Badges::Impl::take_off(Handle handle) {
  const auto known = badges.extract(handle);
  if (known.empty()) {
    return;
  }
  const Handle participant = known.mapped();
  if (const auto who = worn.find(participant); who != worn.end()) {
    who->second.there = false;
  }
  left.push_back(participant);
  if (left.size() > most_departed) {
    const auto oldest = worn.find(left.front());
    if (oldest != worn.end() && !oldest->second.there) {
      worn.erase(oldest);
    }
    left.pop_front();
  }
  tell(participant);
}

Proof Badges::Impl::proof_of(Handle participant) const {
  const auto known = worn.find(participant);
  if (known == worn.end()) {
    return {};
  }
  return {known->second.badge, revoked.contains(known->second.badge->name)};
}

void Badges::Impl::tell(Handle participant) {
  for (Watcher* const watcher : watchers) {
    watcher->different_.push_back(participant);
  }
}

void Badges::Impl::wake() {
  const std::lock_guard guard(watchers_lock);
  for (Watcher* const watcher : watchers) {
    watcher->changed_();
  }
}

void Badges::Impl::watch() {
  std::unique_lock guard(end_lock);
  while (!end_news.wait_for(guard, look_every, [this] { return ending; })) {
    guard.unlock();
    base::program::contain("looking whom to believe", [this] {
      look_whom_to_believe();
      look_at_our_own(std::chrono::steady_clock::now());
    });
    guard.lock();
  }
}

void Badges::Impl::look_whom_to_believe() {
  if (!trust->revoked) {
    return;
  }
  auto names = trust->revoked();
  const std::unique_lock watching(watchers_lock);
  {
    const std::lock_guard guard(lock);
    if (!names) {
      if (std::exchange(trouble, names.error()) == names.error()) {
        return;
      }
      said.push_back(
          fmt::format("{}; until then whom the list named before is not believed", names.error()));
    } else {
      trouble.clear();
      if (*names == revoked) {
        return;
      }
      const std::set<std::string> before = std::exchange(revoked, *std::move(names));
      for (const auto& [participant, one] : worn) {
        const std::string& name = one.badge->name;
        if (one.there && before.contains(name) != revoked.contains(name)) {
          tell(participant);
        }
      }
    }
  }
  for (Watcher* const watcher : watchers) {
    watcher->changed_();
  }
}

void Badges::Impl::look_at_our_own(std::chrono::steady_clock::time_point now) {
  if (!trust->ended || (ended_at && now - *ended_at < tell_again)) {
    return;
  }
  const bool over = std::chrono::system_clock::now() >= trust->until;
  const bool taken_back = [&] {
    const std::lock_guard guard(lock);
    return revoked.contains(trust->name);
  }();
  if (over || taken_back) {
    ended_at = now;
    trust->ended(over ? fmt::format("the certificate of {} expired on {:%F %R} UTC", trust->name,
                                    trust->until)
                      : fmt::format("the certificate of {} has been revoked", trust->name));
  }
}

Badges::Badges(dds_entity_t participant, const std::string& fabric,
               std::shared_ptr<const Trust> trust)
    : impl_(std::make_unique<Impl>(fabric, std::move(trust))) {
  impl_->open(participant);
}

Badges::~Badges() = default;

Badges::Known Badges::look_up(Handle participant) const {
  const std::lock_guard guard(impl_->lock);
  const auto known = impl_->worn.find(participant);
  return known == impl_->worn.end() ? Known{}
                                    : Known{impl_->proof_of(participant), known->second.there};
}

Proof Badges::of_writer(Handle writer) const {
  const std::lock_guard guard(impl_->lock);
  const auto known = impl_->writers.find(writer);
  return known == impl_->writers.end() ? Proof{} : impl_->proof_of(known->second.participant);
}

std::vector<Proof> Badges::all() const {
  const std::lock_guard guard(impl_->lock);
  std::vector<Proof> all;
  for (const auto& [participant, one] : impl_->worn) {
    if (one.there) {
      all.push_back(impl_->proof_of(participant));
    }
  }
  return all;
}

void Badges::listen(dds_listener_t* listener) {
  dds_lset_subscription_matched_arg(
      listener,
      [](dds_entity_t reader, dds_subscription_matched_status_t status, void* self) noexcept {
        static_cast<Impl*>(self)->on_writer(reader, status);
      },
      impl_.get(), true);
}

void Badges::complain(const std::string& about, const std::string& text) {
  {
    const std::lock_guard guard(impl_->lock);
    auto line = impl_->complaints.note("badge", about, text, std::chrono::steady_clock::now());
    if (!line) {
      return;
    }
    impl_->said.push_back(*std::move(line));
  }
  impl_->wake();
}

std::vector<std::string> Badges::take_complaints() {
  const std::lock_guard guard(impl_->lock);
  std::vector<std::string> lines = std::exchange(impl_->said, {});
  for (std::string& line : impl_->complaints.due(std::chrono::steady_clock::now())) {
    lines.push_back(std::move(line));
  }
  return lines;
}

Badges::Watcher::Watcher(Badges& badges, std::function<void()> changed)
    : badges_(badges), changed_(std::move(changed)) {
  const std::lock_guard watching(badges_.impl_->watchers_lock);
  const std::lock_guard guard(badges_.impl_->lock);
  for (const auto& [participant, one] : badges_.impl_->worn) {
    different_.push_back(participant);
  }
  badges_.impl_->watchers.push_back(this);
}

Badges::Watcher::~Watcher() {
  const std::lock_guard watching(badges_.impl_->watchers_lock);
  const std::lock_guard guard(badges_.impl_->lock);
  std::erase(badges_.impl_->watchers, this);
}

std::vector<Handle> Badges::Watcher::take() {
  const std::lock_guard guard(badges_.impl_->lock);
  return std::exchange(different_, {});
}

}  // namespace millrace::fabric::dds
