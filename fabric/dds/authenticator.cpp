#include "fabric/dds/authenticator.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>
#include <mutex>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/program/barrier.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/identity_store.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/one_sided_loss.hpp"
#include "idl/identity.h"

namespace millrace::fabric::dds {

namespace {

using Handle = dds_instance_handle_t;

struct EndpointDeleter {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const {
    dds_builtintopic_free_endpoint(endpoint);
  }
};
using Endpoint = std::unique_ptr<dds_builtintopic_endpoint_t, EndpointDeleter>;

std::chrono::nanoseconds time_slept() {
  timespec boot{};
  timespec steady{};
  ::clock_gettime(CLOCK_MONOTONIC, &steady);
  ::clock_gettime(CLOCK_BOOTTIME, &boot);
  return std::chrono::seconds(boot.tv_sec - steady.tv_sec) +
         std::chrono::nanoseconds(boot.tv_nsec - steady.tv_nsec);
}

/// Neither reliable nor kept: there is nothing to keep.
Qos identity_qos() {
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

struct Authenticator::Impl {
  Impl(std::string own_fabric, std::shared_ptr<const Trust> own_trust)
      : fabric(std::move(own_fabric)), trust(std::move(own_trust)), loss(trust->patience) {}
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void open(dds_entity_t participant, const ProcessInfo& where, std::chrono::milliseconds lease);
  /// Returns the participants that were revoked before and are not in `names`.
  std::vector<std::string> revoke(const std::set<std::string>& names);
  void say(std::string text);
  /// In the thread of the watch, as find_announced().
  std::optional<std::string> lost_on_one_side(OneSidedLoss::Clock::time_point now);
  void find_announced();

  // In Cyclone's threads.
  void on_identity(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;
  void on_writer(dds_entity_t reader, const dds_subscription_matched_status_t& status) noexcept;

  /// Under the lock.
  void tell(Handle participant);

  void wake();
  void look();

  const std::string fabric;
  const std::shared_ptr<const Trust> trust;

  mutable std::mutex lock;
  IdentityStore store;
  OneSidedLoss loss;
  LogLimiter log_limiter;
  std::vector<std::string> lines;

  /// Locked before `lock` if both are needed; a change of the list needs both.
  std::mutex queues_lock;
  std::vector<ChangeQueue*> queues;
  /// Taken before the others. Its holder may end a waiter.
  std::recursive_mutex listeners_lock;
  std::vector<ChangeListener*> listeners;

  Entity topic;
  Entity subscriber;
  Entity reader;
  Entity publisher;
  Entity writer;
  /// Of DCPSParticipant: participants are announced before they are authenticated.
  Entity announcements;
  /// Their GUID prefixes. Used by the watch only.
  std::unordered_map<Handle, std::string> announced;
  /// Last, so that it ends before the objects that it calls.
  std::optional<TrustWatch> watch;
};

Authenticator::Impl::~Impl() {
  watch.reset();
  // No listener runs from here on.
  reader.reset();
}

void Authenticator::Impl::open(dds_entity_t participant, const ProcessInfo& where,
                               std::chrono::milliseconds lease) {
  announcements = Entity(
      check(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
            "read DCPSParticipant"));
  topic = Entity(check(dds_create_topic(participant, &millrace_ParticipantIdentity_desc,
                                        identity_topic_name, nullptr, nullptr),
                       fmt::format("create the topic {}", identity_topic_name)));
  const std::string readers_partition = identity_readers_partition(fabric);
  subscriber = Entity(
      check(dds_create_subscriber(participant, partitions_qos({readers_partition}).get(), nullptr),
            fmt::format("subscribe to {}", readers_partition)));
  const Listener on_match(dds_create_listener(nullptr));
  dds_lset_subscription_matched_arg(
      on_match.get(),
      [](dds_entity_t own, dds_subscription_matched_status_t status, void* self) noexcept {
        static_cast<Impl*>(self)->on_identity(own, status);
      },
      this, true);
  reader = Entity(check(
      dds_create_reader(subscriber.handle(), topic.handle(), identity_qos().get(), on_match.get()),
      fmt::format("read {} in {}", identity_topic_name, readers_partition)));
  publisher = Entity(check(
      dds_create_publisher(participant, partitions_qos(trust->identity_partitions).get(), nullptr),
      "publish an identity"));
  const Qos shown = identity_qos();
  const std::string user_data = format_process_info(where);
  dds_qset_userdata(shown.get(), user_data.data(), user_data.size());
  writer = Entity(check(dds_create_writer(publisher.handle(), topic.handle(), shown.get(), nullptr),
                        fmt::format("write {} in {}", identity_topic_name,
                                    fmt::join(trust->identity_partitions, ", "))));
  watch.emplace(
      trust, lease,
      TrustWatch::Reported{.revoked =
                               [this](const auto& names) {
                                 look();
                                 return revoke(names);
                               },
                           .lost_on_one_side = [this](auto now) { return lost_on_one_side(now); },
                           .slept = time_slept,
                           .log = [this](std::string text) { say(std::move(text)); }});
}

void Authenticator::Impl::on_identity(dds_entity_t own,
                                      const dds_subscription_matched_status_t& status) noexcept {
  base::program::contain("processing an identity", [&] {
    const Handle handle = status.last_publication_handle;
    if (status.current_count_change > 0) {
      const Endpoint endpoint(dds_get_matched_publication_data(own, handle));
      auto identity = endpoint ? parse_participant_identity(fabric, partitions_of(endpoint->qos))
                               : std::nullopt;
      if (!identity) {
        return;
      }
      const std::lock_guard guard(lock);
      loss.on_authenticated(
          endpoint->participant_instance_handle,
          {.guid_prefix = guid_prefix(endpoint->participant_key), .name = identity->name});
      store.add(handle, endpoint->participant_instance_handle, *std::move(identity));
      tell(endpoint->participant_instance_handle);
    } else if (status.current_count_change < 0) {
      const std::lock_guard guard(lock);
      if (const auto left = store.remove(handle)) {
        loss.on_lost(*left);
        tell(*left);
      }
    }
    wake();
    look();
  });
}

void Authenticator::Impl::on_writer(dds_entity_t own,
                                    const dds_subscription_matched_status_t& status) noexcept {
  base::program::contain("processing a writer", [&] {
    const Handle handle = status.last_publication_handle;
    if (status.current_count_change > 0) {
      const Endpoint endpoint(dds_get_matched_publication_data(own, handle));
      if (endpoint) {
        const std::lock_guard guard(lock);
        store.matched(handle, endpoint->participant_instance_handle,
                      guid_prefix(endpoint->participant_key));
      }
    } else if (status.current_count_change < 0) {
      const std::lock_guard guard(lock);
      store.unmatched(handle);
    }
  });
}

void Authenticator::Impl::tell(Handle participant) {
  for (ChangeQueue* const queue : queues) {
    queue->different_.push_back(participant);
  }
}

void Authenticator::Impl::wake() {
  const std::lock_guard guard(queues_lock);
  for (ChangeQueue* const queue : queues) {
    queue->changed_();
  }
}

void Authenticator::Impl::look() {
  const std::lock_guard guard(listeners_lock);
  for (ChangeListener* const change_listener : std::vector(listeners)) {
    if (std::ranges::find(listeners, change_listener) != listeners.end()) {
      change_listener->look_();
    }
  }
}

std::vector<std::string> Authenticator::Impl::revoke(const std::set<std::string>& names) {
  std::vector<Handle> news;
  std::vector<std::string> left_out;
  {
    const std::lock_guard guard(lock);
    left_out = store.left_out_of(names);
    news = store.revoke(names);
    std::ranges::for_each(news, [this](Handle participant) { tell(participant); });
  }
  if (!news.empty()) {
    wake();
  }
  return left_out;
}

std::optional<std::string> Authenticator::Impl::lost_on_one_side(
    OneSidedLoss::Clock::time_point now) {
  find_announced();
  const std::lock_guard guard(lock);
  if (!loss.any()) {
    return std::nullopt;
  }
  std::set<std::string> prefixes;
  for (const auto& [handle, prefix] : announced) {
    prefixes.insert(prefix);
  }
  return loss.find(now, prefixes);
}

void Authenticator::Impl::find_announced() {
  constexpr std::size_t most = 64;
  std::array<void*, most> samples{};
  std::array<dds_sample_info_t, most> infos{};
  dds_return_t count = 0;
  do {
    samples.fill(nullptr);
    count = dds_take(announcements.handle(), samples.data(), infos.data(), most, most);
    for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(count, 0)); ++i) {
      if (infos[i].instance_state == DDS_IST_ALIVE && infos[i].valid_data) {
        const auto& sample = *static_cast<const dds_builtintopic_participant_t*>(samples[i]);
        announced.insert_or_assign(infos[i].instance_handle, guid_prefix(sample.key));
      } else if (infos[i].instance_state != DDS_IST_ALIVE) {
        announced.erase(infos[i].instance_handle);
      }
    }
    if (count > 0) {
      dds_return_loan(announcements.handle(), samples.data(), count);
    }
  } while (count > 0);
}

void Authenticator::Impl::say(std::string text) {
  {
    const std::lock_guard guard(lock);
    lines.push_back(std::move(text));
  }
  wake();
}

Authenticator::Authenticator(dds_entity_t participant, const std::string& fabric,
                             const ProcessInfo& where, std::shared_ptr<const Trust> trust,
                             std::chrono::milliseconds lease)
    : impl_(std::make_unique<Impl>(fabric, std::move(trust))) {
  impl_->open(participant, where, lease);
}

Authenticator::~Authenticator() = default;

Authenticator::Known Authenticator::look_up(Handle participant) const {
  const std::lock_guard guard(impl_->lock);
  return {impl_->store.status_of(participant), impl_->store.is_there(participant)};
}

IdentityStatus Authenticator::of_writer(Handle writer) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->store.status_of_writer(writer);
}

std::string Authenticator::name_of_writer(Handle writer) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->store.name_of_writer(writer);
}

bool Authenticator::has_gateway_of(std::string_view machine) const {
  const std::lock_guard guard(impl_->lock);
  return impl_->store.has_gateway_of(machine);
}

std::vector<IdentityStatus> Authenticator::all() const {
  const std::lock_guard guard(impl_->lock);
  std::vector<IdentityStatus> all;
  for (const Handle participant : impl_->store.participants()) {
    all.push_back(impl_->store.status_of(participant));
  }
  return all;
}

void Authenticator::listen(dds_listener_t* listener) {
  dds_lset_subscription_matched_arg(
      listener,
      [](dds_entity_t reader, dds_subscription_matched_status_t status, void* self) noexcept {
        static_cast<Impl*>(self)->on_writer(reader, status);
      },
      impl_.get(), true);
}

void Authenticator::warn_limited(const std::string& about, const std::string& text) {
  {
    const std::lock_guard guard(impl_->lock);
    auto line = impl_->log_limiter.admit("identity", about, text, std::chrono::steady_clock::now());
    if (!line) {
      return;
    }
    impl_->lines.push_back(*std::move(line));
  }
  impl_->wake();
}

std::vector<std::string> Authenticator::take_warnings() {
  const std::lock_guard guard(impl_->lock);
  std::vector<std::string> lines = std::exchange(impl_->lines, {});
  for (std::string& line : impl_->log_limiter.due(std::chrono::steady_clock::now())) {
    lines.push_back(std::move(line));
  }
  return lines;
}

Authenticator::ChangeQueue::ChangeQueue(Authenticator& authenticator, std::function<void()> changed)
    : authenticator_(authenticator), changed_(std::move(changed)) {
  const std::lock_guard watching(authenticator_.impl_->queues_lock);
  const std::lock_guard guard(authenticator_.impl_->lock);
  different_ = authenticator_.impl_->store.participants();
  authenticator_.impl_->queues.push_back(this);
}

Authenticator::ChangeQueue::~ChangeQueue() {
  const std::lock_guard watching(authenticator_.impl_->queues_lock);
  const std::lock_guard guard(authenticator_.impl_->lock);
  std::erase(authenticator_.impl_->queues, this);
}

std::vector<Handle> Authenticator::ChangeQueue::take() {
  const std::lock_guard guard(authenticator_.impl_->lock);
  return std::exchange(different_, {});
}

Authenticator::ChangeListener::ChangeListener(Authenticator& authenticator,
                                              std::function<void()> look)
    : authenticator_(authenticator), look_(std::move(look)) {
  const std::lock_guard guard(authenticator_.impl_->listeners_lock);
  authenticator_.impl_->listeners.push_back(this);
}

Authenticator::ChangeListener::~ChangeListener() {
  const std::lock_guard guard(authenticator_.impl_->listeners_lock);
  std::erase(authenticator_.impl_->listeners, this);
}

}  // namespace millrace::fabric::dds
