#include "fabric/dds/badges.hpp"

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/program/barrier.hpp"
#include "fabric/badge_book.hpp"
#include "fabric/complaints.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "idl/badge.h"

namespace millrace::fabric::dds {

namespace {

using Handle = dds_instance_handle_t;

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

  void open(dds_entity_t participant, const Whereabouts& where);
  /// Who of those known as revoked is not among `names`.
  std::vector<std::string> revoke(const std::set<std::string>& names);
  void say(std::string text);

  // In Cyclone's threads.
  void on_badge(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;
  void on_writer(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;

  /// Under the lock.
  void tell(Handle participant);

  void wake();
  void look();

  const std::string fabric;
  const std::shared_ptr<const Trust> trust;

  mutable std::mutex lock;
  BadgeBook book;
  Complaints complaints;
  std::vector<std::string> said;

  /// Taken before `lock`, if both are; who changes them holds both.
  std::mutex watchers_lock;
  std::vector<Watcher*> watchers;
  /// Taken before the others. Its holder may end a waiter.
  std::recursive_mutex waiters_lock;
  std::vector<Waiter*> waiters;

  Entity topic;
  Entity subscriber;
  Entity reader;
  Entity publisher;
  Entity writer;
  /// Last: it ends before what it tells.
  std::optional<TrustWatch> watch;
};

Badges::Impl::~Impl() {
  watch.reset();
  // No listener runs from here on.
  reader.reset();
}

void Badges::Impl::open(dds_entity_t participant, const Whereabouts& where) {
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
  const Qos shown = badge_qos();
  const std::string user_data = format_whereabouts(where);
  dds_qset_userdata(shown.get(), user_data.data(), user_data.size());
  writer =
      Entity(check(dds_create_writer(publisher.handle(), topic.handle(), shown.get(), nullptr),
                   fmt::format("write {} in {}", badge_topic_name, fmt::join(trust->badge, ", "))));
  watch.emplace(trust,
                TrustWatch::Told{.revoked =
                                     [this](const auto& names) {
                                       look();
                                       return revoke(names);
                                     },
                                 .said = [this](std::string text) { say(std::move(text)); }});
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
      book.put_on(handle, endpoint->participant_instance_handle, *std::move(badge));
      tell(endpoint->participant_instance_handle);
    } else if (status.current_count_change < 0) {
      const std::lock_guard guard(lock);
      if (const auto left = book.take_off(handle)) {
        tell(*left);
      }
    }
    wake();
    look();
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
        book.matched(handle, endpoint->participant_instance_handle,
                     guid_prefix(endpoint->participant_key));
      }
    } else if (status.current_count_change < 0) {
      const std::lock_guard guard(lock);
      book.unmatched(handle);
    }
  });
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

void Badges::Impl::look() {
  const std::lock_guard guard(waiters_lock);
  for (Waiter* const waiter : std::vector(waiters)) {
    if (std::ranges::find(waiters, waiter) != waiters.end()) {
      waiter->look_();
    }
  }
}

std::vector<std::string> Badges::Impl::revoke(const std::set<std::string>& names) {
  std::vector<Handle> news;
  std::vector<std::string> left_out;
  {
    const std::lock_guard guard(lock);
    left_out = book.left_out_of(names);
    news = book.revoke(names);
    std::ranges::for_each(news, [this](Handle participant) { tell(participant); });
  }
  if (!news.empty()) {
    wake();
  }
  return left_out;
}

void Badges::Impl::say(std::string text) {
  {
    const std::lock_guard guard(lock);
    said.push_back(std::move(text));
  }
  wake();
}

Badges::Badges(dds_entity_t participant, const std::string& fabric, const Whereabouts& where,
               std::shared_ptr<const Trust> trust)
    : impl_(std::make_unique<Impl>(fabric, std::move(trust))) {
  impl_->open(participant, where);
}

Badges::~Badges() = default;

Badges::Known Badges::look_up(Handle participant) const {
  const std::lock_guard guard(impl_->lock);
  return {impl_->book.proof_of(participant), impl_->book.is_there(participant)};
}

Proof Badges::of_writer(Handle writer) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->book.proof_of_writer(writer);
}

std::string Badges::name_of_writer(Handle writer) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->book.name_of_writer(writer);
}

bool Badges::has_gateway_of(std::string_view machine) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->book.has_gateway_of(machine);
}

std::vector<Proof> Badges::all() const {
  const std::lock_guard guard(impl_->lock);
  std::vector<Proof> all;
  for (const Handle participant : impl_->book.participants()) {
    all.push_back(impl_->book.proof_of(participant));
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
  different_ = badges_.impl_->book.participants();
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

Badges::Waiter::Waiter(Badges& badges, std::function<void()> look)
    : badges_(badges), look_(std::move(look)) {
  const std::lock_guard guard(badges_.impl_->waiters_lock);
  badges_.impl_->waiters.push_back(this);
}

Badges::Waiter::~Waiter() {
  const std::lock_guard guard(badges_.impl_->waiters_lock);
  std::erase(badges_.impl_->waiters, this);
}

}  // namespace millrace::fabric::dds
