#include "fabric/ends/call_end.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "fabric/dds/match_queue.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/ends/channel_board.hpp"
#include "fabric/ends/discovery.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

namespace {

SteadyTime now() {
  return std::chrono::steady_clock::now();
}

/// Where one instance gets its requests.
struct Mailbox {
  Mailbox(const dds::Participant& participant, const std::string& partition,
          const wire::EndpointOptions& options)
      : writer(participant, partition, options) {}

  wire::Writer<Request> writer;
  /// What was written and not taken back.
  std::set<RequestKey> standing;
  /// Nobody reads it any more.
  bool vanished = false;
};

}  // namespace

struct CallEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       CallEndListener& own_listener)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        silence(executor),
        machines(own_participant, own_participant.options().fabric,
                 {.lease = own_participant.options().lease}) {}

  void open();
  void close();
  void wrote(wire::Writer<Request>& writer);
  void flush();
  void open_mailbox(const wire::Mailbox& of);
  void close_mailbox(const InstanceId& instance);
  void drain_discovery();
  void look_around();
  void drain_replies();
  void take(const wire::Taken<Reply>& taken);
  void drain_beats();
  void take(const wire::Taken<Beat>& taken);
  void ignore(registry::EndpointHandle stranger, const std::string& reason);
  void announce();
  void await_silence();
  [[nodiscard]] const std::string& fabric() const { return participant.options().fabric; }

  /// Calls the listener, which may end this end in any of its functions.
  template <typename Tell>
  void tell(Tell tell) {
    if (listener != nullptr) {
      tell();
    }
  }

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the end is closed.
  CallEndListener* listener;
  registry::Registry registry;
  // Before the entities whose listeners wake them.
  std::optional<dds::PostOnce> discovery_post;
  std::optional<dds::MatchQueue> matches;
  std::optional<dds::PostOnce> reply_post;
  std::optional<dds::PostOnce> beat_post;
  std::optional<dds::PostOnce> board_post;
  dds::ReaderCount event_readers;
  std::optional<Discovery> discovery;
  /// What discovery has told and nobody was told yet.
  std::vector<std::string> ignored;
  /// Writers that have spoken in the name of an instance that is not theirs: said once of each.
  std::set<registry::EndpointHandle> strangers;
  std::optional<wire::Reader<Reply>> replies;
  std::optional<wire::Reader<Beat>> beats;
  /// Rings when somebody has been silent for too long.
  boost::asio::steady_timer silence;
  std::optional<SteadyTime> silence_at;
  /// Opened when an instance is seen; closed when it is gone and nothing stands in it.
  std::map<InstanceId, Mailbox> mailboxes;
  /// Until the end of this turn of the executor: what was sent at once, and what waits.
  bool in_turn = false;
  std::vector<wire::Writer<Request>*> unsent;
  std::optional<ChannelBoard> channels;
  wire::Writer<MachineStatus> machines;
  std::optional<wire::Writer<Event>> events;
};

void CallEnd::Impl::open() {
  board_post.emplace(executor, weak_from_this(), [this] { channels->look_up(); });
  channels.emplace(participant, fabric(), [this] { board_post->post(); });
  const dds::Listener on_readers(dds_create_listener(nullptr));
  event_readers.listen(on_readers.get());
  events.emplace(participant, fabric(), wire::EndpointOptions{.listener = on_readers.get()});
  events->hold({});

  discovery_post.emplace(executor, weak_from_this(), [this] { drain_discovery(); });
  matches.emplace([this] { discovery_post->post(); });
  reply_post.emplace(executor, weak_from_this(), [this] { drain_replies(); });
  beat_post.emplace(executor, weak_from_this(), [this] { drain_beats(); });

  const dds::Listener on_reply(dds_create_listener(nullptr));
  reply_post->listen_for_data(on_reply.get());
  matches->listen(on_reply.get());
  // All: whose a reply is stands in its key, and what a stranger puts there must not push out what
  // the instance has said.
  replies.emplace(participant, wire::all_services(fabric()), wire::Keep::all,
                  wire::EndpointOptions{.listener = on_reply.get()});

  const dds::Listener on_beat(dds_create_listener(nullptr));
  beat_post->listen_for_data(on_beat.get());
  beats.emplace(participant, fabric(), wire::Keep::last,
                wire::EndpointOptions{.listener = on_beat.get()});

  const dds::Listener on_endpoint(dds_create_listener(nullptr));
  discovery_post->listen_for_data(on_endpoint.get());
  discovery.emplace(participant, on_endpoint.get());
}

void CallEnd::Impl::close() {
  listener = nullptr;
  silence.cancel();
  flush();
  mailboxes.clear();
  replies.reset();
  beats.reset();
  discovery.reset();
}

void CallEnd::Impl::open_mailbox(const wire::Mailbox& of) {
  if (const auto known = mailboxes.find(of.instance); known != mailboxes.end()) {
    known->second.vanished = false;
    return;
  }
  const dds::Listener on_match(dds_create_listener(nullptr));
  matches->listen(on_match.get());
  mailboxes.try_emplace(of.instance, participant,
                        wire::mailbox_partition(fabric(), of.uuid, of.instance),
                        wire::EndpointOptions{.listener = on_match.get(), .batched = true});
}

/// If it is not needed any more.
void CallEnd::Impl::close_mailbox(const InstanceId& instance) {
  const auto mailbox = mailboxes.find(instance);
  if (mailbox != mailboxes.end() && mailbox->second.vanished && mailbox->second.standing.empty()) {
    std::erase(unsent, &mailbox->second.writer);
    mailbox->second.writer.flush();
    mailboxes.erase(mailbox);
  }
}

void CallEnd::Impl::wrote(wire::Writer<Request>& writer) {
  if (in_turn) {
    if (std::ranges::find(unsent, &writer) == unsent.end()) {
      unsent.push_back(&writer);
    }
    return;
  }
  writer.flush();
  in_turn = true;
  boost::asio::post(executor, [self = weak_from_this()] {
    if (const auto alive = self.lock()) {
      alive->flush();
    }
  });
}

void CallEnd::Impl::flush() {
  in_turn = false;
  for (wire::Writer<Request>* writer : unsent) {
    writer->flush();
  }
  unsent.clear();
}

void CallEnd::Impl::drain_discovery() {
  // Each callback may close this end.
  if (listener == nullptr) {
    return;
  }
  look_around();
  // An instance that leaves may have answered just before.
  drain_replies();
  announce();
}

void CallEnd::Impl::look_around() {
  Discovery::News news = discovery->drain(registry, now());
  for (const wire::Mailbox& seen : news.mailboxes) {
    open_mailbox(seen);
  }
  for (const auto& [handle, is] : matches->take()) {
    registry.matched(handle, is);
  }
  for (const InstanceId& instance : registry.take_vanished()) {
    if (const auto mailbox = mailboxes.find(instance);
        mailbox != mailboxes.end() && !registry.is_seen(instance)) {
      mailbox->second.vanished = true;
      close_mailbox(instance);
    }
  }
  ignored.insert(ignored.end(), std::make_move_iterator(news.ignored.begin()),
                 std::make_move_iterator(news.ignored.end()));
}

void CallEnd::Impl::announce() {
  if (listener == nullptr) {
    return;
  }
  const registry::Registry::Changes changes = registry.changes();
  await_silence();
  for (const std::string& reason : std::exchange(ignored, {})) {
    tell([&] { listener->on_ignored(reason); });
  }
  for (const InstanceId& instance : changes.gone) {
    tell([&] { listener->on_instance_gone(instance); });
  }
  for (const InstanceIdentity& instance : changes.ready) {
    tell([&] { listener->on_instance_ready(instance); });
  }
  for (const InstanceIdentity& instance : changes.changed) {
    tell([&] { listener->on_instance_changed(instance); });
  }
}

void CallEnd::Impl::await_silence() {
  const auto next = registry.next_time();
  if (next == silence_at) {
    return;
  }
  silence_at = next;
  silence.cancel();
  if (!next) {
    return;
  }
  silence.expires_at(*next);
  silence.async_wait([self = weak_from_this(), due = *next](boost::system::error_code error) {
    const auto alive = self.lock();
    if (error || !alive || alive->listener == nullptr) {
      return;
    }
    alive->silence_at.reset();
    // While this process stood still it heard nobody; what has come since is not silence.
    alive->registry.stood_still(now() - due);
    alive->drain_beats();
    alive->registry.on_time(now());
    alive->announce();
  });
}

void CallEnd::Impl::drain_replies() {
  while (listener != nullptr) {
    const auto batch = replies->take();
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<Reply>& taken : batch) {
      if (taken.valid && listener != nullptr) {
        take(taken);
      }
    }
  }
}

/// Which instance a reply is from is not for the reply to say.
void CallEnd::Impl::take(const wire::Taken<Reply>& taken) {
  const Reply& reply = taken.value;
  if (!registry.speaks_for(taken.writer, reply.instance)) {
    // It may be here before anybody has looked who has come. That is announced in its own turn.
    look_around();
    discovery_post->post();
  }
  if (registry.speaks_for(taken.writer, reply.instance)) {
    listener->on_reply(reply);
    return;
  }
  ignore(
      taken.writer,
      fmt::format("{}: a reply to call {} in the name of instance {} is dropped: it does not come "
                  "from that instance's writer",
                  reply.key.to_string(), reply.call.to_string(), reply.instance.to_string()));
}

void CallEnd::Impl::ignore(registry::EndpointHandle stranger, const std::string& reason) {
  constexpr std::size_t most_remembered = 256;
  if (strangers.size() >= most_remembered) {
    strangers.clear();
  }
  if (strangers.insert(stranger).second) {
    listener->on_ignored(reason);
  }
}

void CallEnd::Impl::drain_beats() {
  while (listener != nullptr) {
    const auto batch = beats->take();
    if (batch.empty()) {
      break;
    }
    for (const wire::Taken<Beat>& taken : batch) {
      if (taken.valid && listener != nullptr) {
        take(taken);
      }
    }
  }
  // Somebody who was silent may be heard again.
  announce();
}

/// Who it is from is not for the beat to say.
void CallEnd::Impl::take(const wire::Taken<Beat>& taken) {
  if (!registry.beat(taken.writer, now())) {
    // It may be here before anybody has looked who has come, and is followed by the next one.
    return;
  }
  for (const InstanceLoad& load : taken.value.loads) {
    if (registry.beats_for(taken.writer, load.status.instance)) {
      tell([&] { listener->on_load(load); });
    } else if (registry.is_seen(load.status.instance) && listener != nullptr) {
      ignore(taken.writer, fmt::format("a beat that speaks for instance {} is dropped: it does not "
                                       "come from that instance's process",
                                       load.status.instance.to_string()));
    }
  }
}

CallEnd::CallEnd(dds::Participant& participant, boost::asio::any_io_executor executor,
                 CallEndListener& listener)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener)) {
  impl_->open();
}

CallEnd::~CallEnd() {
  impl_->close();
}

tl::expected<void, std::string> CallEnd::publish(const Request& request) {
  const auto mailbox = impl_->mailboxes.find(request.assigned);
  if (mailbox == impl_->mailboxes.end()) {
    return tl::unexpected(fmt::format("instance {} has not shown up on fabric '{}'",
                                      request.assigned.to_string(), impl_->fabric()));
  }
  const auto written = mailbox->second.writer.write(request);
  if (written) {
    mailbox->second.standing.insert(key_of(request));
    impl_->wrote(mailbox->second.writer);
  }
  return written;
}

void CallEnd::withdraw(const RequestKey& key) {
  const auto mailbox = impl_->mailboxes.find(key.instance);
  if (mailbox != impl_->mailboxes.end()) {
    mailbox->second.writer.withdraw(
        Request{.key = key.key, .call = {.epoch = key.epoch}, .assigned = key.instance});
    mailbox->second.standing.erase(key);
    impl_->wrote(mailbox->second.writer);
    impl_->close_mailbox(key.instance);
  }
}

tl::expected<void, std::string> CallEnd::publish(const ChannelStatus& status) {
  return impl_->channels->put(status);
}

tl::expected<void, std::string> CallEnd::publish(const MachineStatus& status) {
  return impl_->machines.write(status);
}

tl::expected<void, std::string> CallEnd::publish(const Event& event) {
  // Nobody can ask for it later.
  if (!impl_->event_readers.present()) {
    return {};
  }
  return impl_->events->write(event);
}

void CallEnd::assert_machines() {
  impl_->machines.assert_itself();
}

void CallEnd::let_go(const ChannelKey& key) {
  impl_->channels->let_go(key);
}

void CallEnd::let_go(const MachineStatus& status) {
  impl_->machines.let_go(status);
}

}  // namespace millrace::fabric::ends
