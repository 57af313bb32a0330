#include "fabric/ends/call_end.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "fabric/complaints.hpp"
#include "fabric/dds/match_queue.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/ends/channel_board.hpp"
#include "fabric/ends/mailboxes.hpp"
#include "fabric/ends/roster.hpp"
#include "fabric/wire/foreign_replies.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

namespace {

SteadyTime steady_now() {
  return std::chrono::steady_clock::now();
}

}  // namespace

struct CallEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       CallEndListener& own_listener, Of own_kind)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        roster(executor,
               {.drain_beats = [this] { drain_beats(); }, .announce = [this] { announce(); }}),
        kind(own_kind) {}

  void open();
  void close();
  void look_who_reads();
  /// What observers are told at the end of a turn of the loop: its events and states share
  /// datagrams. A datagram for each of them, to each observer, costs more than the call.
  void flush();
  void drain_discovery();
  void look_around();
  void note_dropped();
  void drain_replies();
  void take(const wire::Taken<Reply>& taken);
  void drain_beats();
  void take(registry::EndpointHandle writer, const InstanceLoad& load, bool is_theirs);
  void ignore(registry::EndpointHandle stranger, const std::string& reason);
  void announce();
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
  // Before the entities whose listeners wake them.
  std::optional<dds::PostOnce> discovery_post;
  std::optional<dds::MatchQueue> matches;
  std::optional<dds::PostOnce> reply_post;
  std::optional<dds::PostOnce> beat_post;
  std::optional<dds::PostOnce> readers_post;
  std::optional<dds::PostOnce> flush_post;
  dds::ReaderCount event_readers{[this] { readers_post->post(); }};
  Roster roster;
  Of kind;
  /// What discovery has told and nobody was told yet.
  std::vector<std::string> ignored;
  /// What a stranger may do ten thousand times a second is said once.
  Complaints complaints;
  std::optional<wire::ForeignReplies> replies;
  /// Of those that are of too many keys, as was told.
  std::uint64_t told_dropped = 0;
  std::optional<Mailboxes> mailboxes;
  std::optional<ChannelBoard> channels;
  std::optional<wire::Writer<MachineStatus>> machines;
  std::optional<wire::Writer<Event>> events;
};

void CallEnd::Impl::open() {
  readers_post.emplace(executor, weak_from_this(), [this] { look_who_reads(); });
  if (kind == Of::gateway) {
    machines.emplace(participant, fabric(),
                     wire::EndpointOptions{.lease = participant.options().lease});
    channels.emplace(participant, fabric(), [this] { readers_post->post(); });
  }
  const dds::Listener on_readers(dds_create_listener(nullptr));
  event_readers.listen(on_readers.get());
  flush_post.emplace(executor, weak_from_this(), [this] { flush(); });
  events.emplace(participant, fabric(),
                 wire::EndpointOptions{.listener = on_readers.get(), .batched = true});
  // The topic has no key, so any event stands for all of them.
  const auto held = events->hold({.key = {.machine = "any", .channel = 1}});
  assert(held);
  static_cast<void>(held);

  discovery_post.emplace(executor, weak_from_this(), [this] { drain_discovery(); });
  matches.emplace([this] { discovery_post->post(); });
  reply_post.emplace(executor, weak_from_this(), [this] { drain_replies(); });
  beat_post.emplace(executor, weak_from_this(), [this] { drain_beats(); });
  mailboxes.emplace(participant, executor, weak_from_this(), *matches);

  const dds::Listener on_reply(dds_create_listener(nullptr));
  reply_post->listen_for_data(on_reply.get());
  matches->listen(on_reply.get());
  replies.emplace(participant, wire::all_services(fabric()),
                  wire::EndpointOptions{.listener = on_reply.get()});
  roster.open(participant, weak_from_this(), *discovery_post, *beat_post);
}

void CallEnd::Impl::flush() {
  events->flush();
  if (channels) {
    channels->flush();
  }
}

void CallEnd::Impl::close() {
  listener = nullptr;
  flush();
  mailboxes.reset();
  replies.reset();
  roster.close();
}

void CallEnd::Impl::look_who_reads() {
  if (channels) {
    channels->look_up();
  }
  tell([&] { listener->on_readers(channels && channels->watched(), event_readers.present()); });
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
  Discovery::News news = roster.look_around();
  for (const wire::Mailbox& seen : news.mailboxes) {
    mailboxes->open(seen);
  }
  for (const auto& [handle, is] : matches->take()) {
    roster.registry().matched(handle, is);
  }
  for (const InstanceId& instance : roster.registry().take_vanished()) {
    if (!roster.registry().is_seen(instance)) {
      mailboxes->on_vanished(instance);
    }
  }
  for (const Discovery::Ignored& one : news.ignored) {
    if (auto line = complaints.note(one.kind, one.about, one.reason, steady_now())) {
      ignored.push_back(*std::move(line));
    }
  }
}

void CallEnd::Impl::announce() {
  if (listener == nullptr) {
    return;
  }
  const registry::Registry::Changes changes = roster.changes();
  for (std::string& line : complaints.due(steady_now())) {
    ignored.push_back(std::move(line));
  }
  if (replies) {
    note_dropped();
  }
  if (participant.badges() != nullptr) {
    std::ranges::move(participant.badges()->take_complaints(), std::back_inserter(ignored));
  }
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

void CallEnd::Impl::note_dropped() {
  const std::uint64_t dropped = replies->dropped();
  if (std::exchange(told_dropped, dropped) == dropped) {
    return;
  }
  if (auto line = complaints.note(
          "keys", "",
          fmt::format(
              "replies to calls that nobody asked here, of more than {} channels, instances "
              "and callers: those of others are dropped",
              ReplyKeys::most_others),
          steady_now())) {
    ignored.push_back(*std::move(line));
  }
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
  if (!roster.registry().speaks_for(taken.writer, reply.instance)) {
    // It may be here before anybody has looked who has come. That is announced in its own turn.
    look_around();
    discovery_post->post();
  }
  if (roster.registry().speaks_for(taken.writer, reply.instance)) {
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
  if (const auto line =
          complaints.note("stranger", std::to_string(stranger), reason, steady_now())) {
    listener->on_ignored(*line);
  }
}

void CallEnd::Impl::drain_beats() {
  const auto use = [this](registry::EndpointHandle writer, const InstanceLoad& load, bool is_theirs,
                          SteadyTime) { take(writer, load, is_theirs); };
  while (listener != nullptr && roster.take_beats(use)) {
  }
  // Somebody who was silent may be heard again.
  announce();
}

/// Who it is from is not for the beat to say.
void CallEnd::Impl::take(registry::EndpointHandle writer, const InstanceLoad& load,
                         bool is_theirs) {
  if (listener == nullptr) {
    return;
  }
  if (is_theirs) {
    listener->on_load(load);
  } else if (roster.registry().is_seen(load.status.instance)) {
    ignore(writer, fmt::format("a beat that speaks for instance {} is dropped: it does not come "
                               "from that instance's process",
                               load.status.instance.to_string()));
  }
}

CallEnd::CallEnd(dds::Participant& participant, boost::asio::any_io_executor executor,
                 CallEndListener& listener, Of of)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener, of)) {
  impl_->open();
}

CallEnd::~CallEnd() {
  impl_->close();
}

tl::expected<void, std::string> CallEnd::publish(const Request& request) {
  impl_->replies->ask(key_of(request));
  return impl_->mailboxes->publish(request);
}

void CallEnd::withdraw(const RequestKey& key) {
  impl_->mailboxes->withdraw(key);
}

tl::expected<void, std::string> CallEnd::publish(const ChannelStatus& status) {
  auto put = impl_->channels->put(status);
  if (impl_->channels->watched()) {
    impl_->flush_post->post();
  }
  return put;
}

tl::expected<void, std::string> CallEnd::publish(const MachineStatus& status) {
  return impl_->machines->write(status);
}

tl::expected<void, std::string> CallEnd::publish(const Event& event) {
  // Nobody can ask for it later.
  if (!impl_->event_readers.present()) {
    return {};
  }
  auto written = impl_->events->write(event);
  impl_->flush_post->post();
  return written;
}

void CallEnd::assert_machines() {
  impl_->machines->assert_itself();
}

void CallEnd::let_go(const ChannelKey& key) {
  impl_->channels->let_go(key);
  impl_->flush_post->post();
}

void CallEnd::let_go(const MachineStatus& status) {
  // DDS reports no unregistration while another writer has this key.
  MachineStatus last = status;
  last.connected = false;
  last.claimed = {};
  static_cast<void>(impl_->machines->write(last));
  impl_->machines->let_go(status);
}

}  // namespace millrace::fabric::ends
