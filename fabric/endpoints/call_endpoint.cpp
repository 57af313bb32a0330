#include "fabric/endpoints/call_endpoint.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "fabric/endpoints/channel_status_writer.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/request_writers.hpp"
#include "fabric/endpoints/tell.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/wire/foreign_replies.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

namespace {

SteadyTime steady_now() {
  return std::chrono::steady_clock::now();
}

/// A person does not see the difference, and a call is mostly over by then. Of an at-most-once call
/// the status goes out before the request.
constexpr std::chrono::milliseconds status_pause{20};

}  // namespace

struct CallEndpoint::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       CallEndpointListener& own_listener, Of own_kind)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        liveness(executor, {.on_load = [this](auto writer, const InstanceLoad& load, bool is_theirs,
                                              SteadyTime) { take(writer, load, is_theirs); },
                            .announce = [this] { announce(); }}),
        kind(own_kind),
        status_timer(executor) {}

  void open();
  void close();
  void check_readers();
  /// Publishes events for observers at the end of a turn of the loop, so that they share datagrams:
  /// one datagram for each of them, to each observer, costs more than the call.
  void flush();
  /// Publishes the last status of each channel, at most every `status_pause`.
  void flush_statuses_soon();
  void drain_discovery();
  void update();
  void note_dropped();
  void take(const wire::Taken<Reply>& taken);
  void drain_heartbeats();
  void take(registry::EndpointHandle writer, const InstanceLoad& load, bool is_theirs);
  void ignore(registry::EndpointHandle stranger, const std::string& reason);
  void announce();
  [[nodiscard]] const std::string& fabric() const { return participant.options().fabric; }

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the endpoint is closed.
  CallEndpointListener* listener;
  // Before the entities whose listeners wake them.
  std::optional<dds::PostOnce> discovery_post;
  std::optional<dds::MatchQueue> matches;
  std::optional<dds::PostOnce> heartbeat_post;
  std::optional<dds::PostOnce> readers_post;
  std::optional<dds::PostOnce> flush_post;
  dds::ReaderCount event_readers{[this] { readers_post->post(); }};
  LivenessMonitor liveness;
  Of kind;
  /// Rejected endpoints that discovery found and the listener was not yet told of.
  std::vector<std::string> ignored;
  /// A warning that a stranger can cause ten thousand times a second is logged once.
  LogLimiter log_limiter;
  wire::Subscription<Reply, wire::ForeignReplies> replies;
  /// The number of replies with too many keys, as reported.
  std::uint64_t reported_dropped = 0;
  std::optional<RequestWriters> request_writers;
  std::optional<ChannelStatusWriter> channels;
  boost::asio::steady_timer status_timer;
  /// The timer runs.
  bool statuses_wait = false;
  SteadyTime statuses_flushed{};
  std::optional<wire::Writer<MachineStatus>> machines;
  std::optional<wire::Writer<Event>> events;
};

void CallEndpoint::Impl::open() {
  readers_post.emplace(executor, weak_from_this(), [this] { check_readers(); });
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
  heartbeat_post.emplace(executor, weak_from_this(), [this] { drain_heartbeats(); });
  request_writers.emplace(participant, executor, weak_from_this(), *matches);

  const dds::Listener on_match(dds_create_listener(nullptr));
  matches->listen(on_match.get());
  replies = wire::Subscription<Reply, wire::ForeignReplies>(
      participant, executor, wire::all_services(fabric()),
      [this](const wire::Taken<Reply>& taken) {
        if (taken.valid) {
          take(taken);
        }
      },
      {.endpoint = {.listener = on_match.get()}});
  liveness.open(participant, Discovery::Of::calls, weak_from_this(), *discovery_post,
                *heartbeat_post);
}

void CallEndpoint::Impl::flush() {
  events->flush();
}

void CallEndpoint::Impl::flush_statuses_soon() {
  if (!channels->has_readers() || std::exchange(statuses_wait, true)) {
    return;
  }
  status_timer.expires_at(statuses_flushed + status_pause);
  status_timer.async_wait([weak = weak_from_this()](boost::system::error_code) {
    if (const auto alive = weak.lock()) {
      alive->statuses_wait = false;
      alive->statuses_flushed = steady_now();
      alive->channels->flush();
    }
  });
}

void CallEndpoint::Impl::close() {
  listener = nullptr;
  flush();
  if (channels) {
    channels->flush();
  }
  request_writers.reset();
  replies.reset();
  liveness.close();
}

void CallEndpoint::Impl::check_readers() {
  if (channels) {
    channels->update_readers();
  }
  tell(listener, &CallEndpointListener::on_readers, channels && channels->has_readers(),
       event_readers.present());
}

void CallEndpoint::Impl::drain_discovery() {
  // Each callback may close this end.
  if (listener == nullptr) {
    return;
  }
  update();
  // An instance that leaves may have answered just before.
  replies.drain();
  announce();
}

void CallEndpoint::Impl::update() {
  Discovery::News news = liveness.update();
  for (const auto& [handle, is] : matches->take()) {
    liveness.registry().matched(handle, is);
  }
  for (const auto& [instance, uuid] : liveness.registry().touched_homes()) {
    if (uuid) {
      request_writers->open({*uuid, instance});
    } else {
      request_writers->on_vanished(instance);
    }
  }
  for (const Discovery::Ignored& dropped : news.ignored) {
    if (auto line = log_limiter.admit(dropped.kind, dropped.about, dropped.reason, steady_now())) {
      ignored.push_back(*std::move(line));
    }
  }
}

void CallEndpoint::Impl::announce() {
  if (listener == nullptr) {
    return;
  }
  const registry::InstanceRegistry::Changes changes = liveness.changes();
  for (std::string& line : log_limiter.due(steady_now())) {
    ignored.push_back(std::move(line));
  }
  if (replies) {
    note_dropped();
  }
  if (participant.authenticator() != nullptr) {
    std::ranges::move(participant.authenticator()->take_warnings(), std::back_inserter(ignored));
  }
  for (const std::string& reason : std::exchange(ignored, {})) {
    tell(listener, &CallEndpointListener::on_ignored, reason);
  }
  for (const InstanceId& instance : changes.gone) {
    tell(listener, &CallEndpointListener::on_instance_gone, instance);
  }
  for (const InstanceIdentity& instance : changes.ready) {
    tell(listener, &CallEndpointListener::on_instance_ready, instance);
  }
  for (const InstanceIdentity& instance : changes.changed) {
    tell(listener, &CallEndpointListener::on_instance_changed, instance);
  }
}

void CallEndpoint::Impl::note_dropped() {
  const std::uint64_t dropped = replies->dropped();
  if (std::exchange(reported_dropped, dropped) == dropped) {
    return;
  }
  if (auto line = log_limiter.admit(
          "keys", "",
          fmt::format("unexpected replies from more than {} channels, instances and requesters: "
                      "further ones are dropped without a log line",
                      ReplyKeys::most_others),
          steady_now())) {
    ignored.push_back(*std::move(line));
  }
}

/// The writer decides which instance a reply is from, not the reply's contents.
void CallEndpoint::Impl::take(const wire::Taken<Reply>& taken) {
  const Reply& reply = taken.value;
  if (!liveness.registry().speaks_for(taken.writer, reply.instance)) {
    // A heartbeat may arrive before discovery was read. Its instances are announced in their own
    // turn.
    update();
    discovery_post->post();
  }
  if (liveness.registry().speaks_for(taken.writer, reply.instance)) {
    listener->on_reply(reply);
    return;
  }
  ignore(taken.writer,
         fmt::format("{}: a reply to call {} from instance {} is dropped: another writer sent it",
                     reply.key.to_string(), reply.call.to_string(), reply.instance.to_string()));
}

void CallEndpoint::Impl::ignore(registry::EndpointHandle stranger, const std::string& reason) {
  if (const auto line =
          log_limiter.admit("stranger", std::to_string(stranger), reason, steady_now())) {
    listener->on_ignored(*line);
  }
}

void CallEndpoint::Impl::drain_heartbeats() {
  liveness.drain_heartbeats();
  // An instance that was silent may be heard again.
  announce();
}

/// The writer decides whose heartbeat it is, not the heartbeat's contents.
void CallEndpoint::Impl::take(registry::EndpointHandle writer, const InstanceLoad& load,
                              bool is_theirs) {
  if (listener == nullptr) {
    return;
  }
  if (is_theirs) {
    listener->on_load(load);
  } else if (liveness.registry().has_home(load.status.instance)) {
    ignore(writer, fmt::format("a heartbeat of instance {} is dropped: another process sent it",
                               load.status.instance.to_string()));
  }
}

CallEndpoint::CallEndpoint(dds::Participant& participant, boost::asio::any_io_executor executor,
                           CallEndpointListener& listener, Of of)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener, of)) {
  impl_->open();
}

CallEndpoint::~CallEndpoint() {
  impl_->close();
}

tl::expected<void, std::string> CallEndpoint::publish(const Request& request) {
  if (impl_->channels &&
      impl_->liveness.registry().delivery_of(request.assigned) == Delivery::at_most_once) {
    // If this process is killed now, the gateway that stands by must not take it for a new call.
    impl_->channels->flush(request.key);
  }
  impl_->replies->ask(key_of(request));
  impl_->liveness.requested(request.assigned);
  return impl_->request_writers->publish(request);
}

void CallEndpoint::withdraw(const RequestKey& key) {
  impl_->request_writers->withdraw(key);
}

void CallEndpoint::publish(const ChannelStatus& status) {
  impl_->channels->write(status);
  impl_->flush_statuses_soon();
}

tl::expected<void, std::string> CallEndpoint::publish(const MachineStatus& status) {
  return impl_->machines->write(status);
}

tl::expected<void, std::string> CallEndpoint::publish(const Event& event) {
  // No later reader can get it.
  if (!impl_->event_readers.present()) {
    return {};
  }
  auto written = impl_->events->write(event);
  impl_->flush_post->post();
  return written;
}

void CallEndpoint::assert_machines() {
  impl_->machines->assert_itself();
}

void CallEndpoint::unregister(const ChannelKey& key) {
  impl_->channels->unregister(key);
}

void CallEndpoint::unregister(const MachineStatus& status) {
  // DDS reports no unregistration while another writer has this key.
  MachineStatus last = status;
  last.connected = false;
  last.claimed = {};
  static_cast<void>(impl_->machines->write(last));
  impl_->machines->unregister(status);
}

}  // namespace millrace::fabric::endpoints
