#include "fabric/observer/observer.hpp"

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "fabric/dds/post_once.hpp"
#include "fabric/ends/roster.hpp"
#include "fabric/observer/context.hpp"
#include "fabric/observer/loads.hpp"
#include "fabric/observer/notices.hpp"
#include "fabric/wire/command_codec.hpp"
#include "fabric/wire/data_codec.hpp"
#include "fabric/wire/notice_codec.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::observer {

namespace {

using wire::Presence;

/// Batches of 64 samples that are taken from one reader before the next one has its turn.
constexpr int batches_per_turn = 16;

/// A sample as an entry; nothing if it only tells of a presence nobody asks for.
template <typename Value>
std::optional<Sample> sample_of(wire::Taken<Value>&& taken) {
  if (!taken.valid) {
    return std::nullopt;
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<Request>&& taken) {
  if (taken.valid) {
    return std::move(taken.value);
  }
  if (taken.presence == Presence::withdrawn) {
    // The context knows the number.
    return Withdrawal{.key = std::move(taken.value.key),
                      .call = {.epoch = taken.value.call.epoch},
                      .instance = taken.value.assigned};
  }
  return std::nullopt;
}

/// A channel or machine whose gateway left would look alive for ever.
constexpr const char* gateway_gone = "its gateway is gone";

std::optional<Sample> sample_of(wire::Taken<ChannelStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return ChannelStatus{.key = std::move(taken.value.key),
                         .since = std::chrono::system_clock::now(),
                         .reason = gateway_gone};
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<MachineStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return MachineStatus{.machine = std::move(taken.value.machine),
                         .gateway = taken.value.gateway,
                         .since = std::chrono::system_clock::now(),
                         .reason = gateway_gone};
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<DataSample>&& taken) {
  if (taken.presence != Presence::alive) {
    // Without its values: nobody tells of them any more.
    return DataSample{.key = std::move(taken.value.key),
                      .group = std::move(taken.value.group),
                      .at = std::chrono::system_clock::now()};
  }
  return std::move(taken.value);
}

}  // namespace

struct Observer::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       ObserverListener& own_listener)
      : participant(own_participant),
        listener(&own_listener),
        roster(executor,
               {.drain_beats = [this] { drain_beats(); }, .announce = [this] { tell_changes(); }}) {
    roster.registry().match_all();
  }

  void open(const boost::asio::any_io_executor& executor, Interest interest);
  void close();
  bool drain();
  void drain_discovery();
  bool drain_beats();
  void tell_changes();
  void tell_ignored();
  void hand_out(Sample sample);

  template <typename Value>
  void open(std::optional<wire::Reader<Value>>& reader, const std::string& partition) {
    const dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, partition, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_data.get()});
  }

  template <typename Use>
  void for_each_reader(Use use) {
    use(machines);
    use(channels);
    use(requests);
    use(replies);
    use(events);
    use(commands);
    use(outcomes);
    use(data);
    use(programs);
    use(notices);
  }

  /// A sample as an entry; nothing if it is no news.
  template <typename Value>
  std::optional<Sample> news_of(wire::Taken<Value>&& taken) {
    return sample_of(std::move(taken));
  }
  std::optional<Sample> news_of(wire::Taken<Notice>&& taken) {
    auto kept = notice_owners.take(taken.value.key, taken.writer, taken.valid,
                                   taken.presence == Presence::alive);
    if (!kept) {
      return std::nullopt;
    }
    taken.value.key = std::move(kept->key);
    auto news = kept->is_over ? known_notices.over(taken.value.key)
                              : known_notices.said(std::move(taken.value));
    return news ? std::optional<Sample>(std::move(*news)) : std::nullopt;
  }

  /// With trust: who has said what stands.
  template <typename Value>
  void remember(const wire::Taken<Value>& taken) {
    static_cast<void>(taken);
  }
  void remember(const wire::Taken<MachineStatus>& taken) {
    remember(taken, {taken.value.machine, taken.value.gateway}, machines_of);
  }
  void remember(const wire::Taken<ChannelStatus>& taken) {
    remember(taken, taken.value.key, channels_of);
  }
  template <typename Value, typename Key>
  void remember(const wire::Taken<Value>& taken, const Key& key,
                std::map<Key, dds_instance_handle_t>& by_key) {
    // Far more than there are; of others it is not noticed that they are revoked.
    constexpr std::size_t most = 65'536;
    if (participant.badges() == nullptr) {
      return;
    }
    if (taken.presence != Presence::alive) {
      by_key.erase(key);
    } else if (taken.valid && (by_key.size() < most || by_key.contains(key))) {
      by_key.insert_or_assign(key, taken.writer);
    }
  }
  /// Whose certificates have been taken back since: what they have said holds no more.
  void drop_revoked();
  void drop_gone_notices();

  /// One turn of a reader; true if there may be more.
  template <typename Value>
  bool drain(std::optional<wire::Reader<Value>>& reader) {
    for (int i = 0; i < batches_per_turn && listener != nullptr && reader; ++i) {
      auto batch = reader->take();
      if (batch.empty()) {
        return false;
      }
      for (wire::Taken<Value>& taken : batch) {
        remember(taken);
        if (auto sample = news_of(std::move(taken))) {
          hand_out(std::move(*sample));
        }
      }
    }
    return listener != nullptr && reader;
  }

  dds::Participant& participant;
  /// Null once the observer is closed.
  ObserverListener* listener;
  Context context;
  std::uint64_t delivered = 0;
  // Before the entities that wake it.
  std::optional<dds::PostOnce> post;
  ends::Roster roster;
  std::optional<dds::Badges::Watcher> badges;
  std::map<std::pair<std::string, InstanceId>, dds_instance_handle_t> machines_of;
  std::map<ChannelKey, dds_instance_handle_t> channels_of;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
  Loads loads;
  std::optional<wire::Reader<Request>> requests;
  std::optional<wire::Reader<Reply>> replies;
  std::optional<wire::Reader<Event>> events;
  std::optional<wire::Reader<Command>> commands;
  std::optional<wire::Reader<Outcome>> outcomes;
  std::optional<wire::Reader<DataSample>> data;
  std::optional<wire::Reader<ProgramEvent>> programs;
  Notices known_notices;
  NoticeOwners notice_owners;
  std::optional<wire::Reader<Notice>> notices;
};

void Observer::Impl::open(const boost::asio::any_io_executor& executor, Interest interest) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  if (participant.badges() != nullptr) {
    badges.emplace(*participant.badges(), [this] { post->post(); });
  }
  const std::string& fabric = participant.options().fabric;
  const std::string services = wire::all_services(fabric);
  if (interest == Interest::data || interest == Interest::everything) {
    open(data, fabric);
    open(programs, fabric);
  }
  if (interest == Interest::data) {
    return;
  }
  open(channels, fabric);
  if (interest != Interest::calls) {
    roster.open(participant, weak_from_this(), *post, *post);
    open(machines, fabric);
  }
  if (interest != Interest::states) {
    open(events, fabric);
  }
  if (interest == Interest::everything) {
    open(requests, services);
    open(replies, services);
    open(commands, fabric);
    open(outcomes, fabric);
    open(notices, fabric);
  }
}

void Observer::Impl::close() {
  listener = nullptr;
  badges.reset();
  for_each_reader([](auto& reader) { reader.reset(); });
  roster.close();
}

bool Observer::Impl::drain() {
  drain_discovery();
  bool more = drain_beats();
  for_each_reader([&](auto& reader) { more = drain(reader) || more; });
  drop_revoked();
  drop_gone_notices();
  tell_ignored();
  if (more) {
    // Others on the executor have their turn in between.
    post->post();
  }
  return more;
}

void Observer::Impl::drain_discovery() {
  if (listener != nullptr) {
    const ends::Discovery::News news = roster.look_around();
    if (participant.badges() != nullptr) {
      for (const ends::Discovery::Ignored& one : news.ignored) {
        participant.badges()->complain(one.kind + one.about, one.reason);
      }
    }
    tell_changes();
  }
}

/// Of beats nobody wants to know each.
bool Observer::Impl::drain_beats() {
  const auto use = [this](registry::EndpointHandle, const InstanceLoad& load, bool is_theirs,
                          SteadyTime at) {
    if (is_theirs && loads.is_news(load.status, at)) {
      hand_out(load.status);
    }
  };
  bool more = true;
  for (int i = 0; i < batches_per_turn && more; ++i) {
    more = listener != nullptr && roster.take_beats(use);
  }
  tell_changes();
  return more;
}

void Observer::Impl::tell_changes() {
  if (listener == nullptr) {
    return;
  }
  const registry::Registry::Changes changes = roster.changes();
  static_cast<void>(roster.registry().take_vanished());
  for (const InstanceId& instance : changes.gone) {
    loads.forget(instance);
    hand_out(InstanceNews{Change::gone, {.id = instance}});
  }
  for (const InstanceIdentity& identity : changes.ready) {
    hand_out(InstanceNews{Change::ready, identity});
  }
  for (const InstanceIdentity& identity : changes.changed) {
    hand_out(InstanceNews{Change::changed, identity});
  }
}

void Observer::Impl::drop_gone_notices() {
  if (listener == nullptr || !notices) {
    return;
  }
  for (const NoticeKey& key : notice_owners.gone(notices->matched())) {
    if (auto news = known_notices.over(key)) {
      hand_out(std::move(*news));
    }
  }
}

void Observer::Impl::drop_revoked() {
  if (!badges || badges->take().empty()) {
    return;
  }
  const auto revoked = [this](dds_instance_handle_t writer) {
    return participant.badges()->of_writer(writer).revoked;
  };
  std::vector<Sample> over;
  std::erase_if(channels_of, [&](const auto& one) {
    const bool is = revoked(one.second);
    if (is) {
      over.emplace_back(*sample_of(
          wire::Taken<ChannelStatus>{.value = {.key = one.first}, .presence = Presence::orphaned}));
    }
    return is;
  });
  std::erase_if(machines_of, [&](const auto& one) {
    const bool is = revoked(one.second);
    if (is) {
      over.emplace_back(*sample_of(wire::Taken<MachineStatus>{
          .value = {.machine = one.first.first, .gateway = one.first.second},
          .presence = Presence::orphaned}));
    }
    return is;
  });
  for (Sample& sample : over) {
    hand_out(std::move(sample));
  }
}

void Observer::Impl::tell_ignored() {
  if (participant.badges() == nullptr || listener == nullptr) {
    return;
  }
  for (const std::string& line : participant.badges()->take_complaints()) {
    if (listener != nullptr) {
      listener->on_ignored(line);
    }
  }
}

void Observer::Impl::hand_out(Sample sample) {
  if (listener == nullptr) {
    return;
  }
  ++delivered;
  Entry entry{.at = std::chrono::system_clock::now(), .sample = std::move(sample)};
  context.complete(entry);
  listener->on_entry(std::move(entry));
}

Observer::Observer(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                   ObserverListener& listener, Interest interest)
    : impl_(std::make_shared<Impl>(participant, executor, listener)) {
  impl_->open(executor, interest);
}

Observer::~Observer() {
  impl_->close();
}

bool Observer::drain() {
  return impl_->drain();
}

Counts Observer::counts() const {
  Counts counts{.delivered = impl_->delivered};
  impl_->for_each_reader([&](const auto& reader) {
    if (reader) {
      counts.lost += reader->lost();
    }
  });
  return counts;
}

}  // namespace millrace::fabric::observer
