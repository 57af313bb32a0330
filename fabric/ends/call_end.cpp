#include "fabric/ends/call_end.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

#include "fabric/dds/post_once.hpp"
#include "fabric/ends/channel_board.hpp"
#include "fabric/ends/discovery.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

struct CallEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       CallEndListener& own_listener)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        machines(own_participant, own_participant.options().fabric,
                 {.lease = own_participant.options().lease}) {}

  void open();
  void close();
  void wrote(wire::Writer<Request>& writer);
  void flush();
  void open_requests(const std::string& uuid);
  void drain_discovery();
  void look_around();
  void drain_replies();
  void take(const wire::Taken<Reply>& taken);
  void announce(const registry::Registry::Changes& changes);
  [[nodiscard]] std::set<registry::EndpointHandle> matched() const;
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
  std::optional<dds::PostOnce> reply_post;
  std::optional<dds::PostOnce> board_post;
  dds::ReaderCount event_readers;
  std::optional<Discovery> discovery;
  /// What discovery has told and nobody was told yet.
  std::vector<std::string> ignored;
  /// Writers that have spoken in the name of an instance that is not theirs: said once of each.
  std::set<registry::EndpointHandle> strangers;
  std::optional<wire::Reader<Reply>> replies;
  /// By canonical UUID. They stay when the last instance leaves, because a pending call waits in
  /// them for the next one.
  std::map<std::string, wire::Writer<Request>> requests;
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
  reply_post.emplace(executor, weak_from_this(), [this] { drain_replies(); });

  const dds::Listener on_reply(dds_create_listener(nullptr));
  reply_post->listen_for_data(on_reply.get());
  discovery_post->listen_for_matches(on_reply.get());
  replies.emplace(participant, wire::all_services(fabric()), wire::Keep::last,
                  wire::EndpointOptions{.listener = on_reply.get()});

  const dds::Listener on_endpoint(dds_create_listener(nullptr));
  discovery_post->listen_for_data(on_endpoint.get());
  discovery.emplace(participant, on_endpoint.get());
}

void CallEnd::Impl::close() {
  listener = nullptr;
  flush();
  requests.clear();
  replies.reset();
  discovery.reset();
}

void CallEnd::Impl::open_requests(const std::string& uuid) {
  if (requests.contains(uuid)) {
    return;
  }
  const dds::Listener on_match(dds_create_listener(nullptr));
  discovery_post->listen_for_matches(on_match.get());
  requests.try_emplace(uuid, participant, wire::service_partition(fabric(), uuid),
                       wire::EndpointOptions{.listener = on_match.get(), .batched = true});
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

std::set<registry::EndpointHandle> CallEnd::Impl::matched() const {
  std::set<registry::EndpointHandle> handles;
  for (const registry::EndpointHandle handle : replies->matched()) {
    handles.insert(handle);
  }
  for (const auto& [uuid, writer] : requests) {
    for (const registry::EndpointHandle handle : writer.matched()) {
      handles.insert(handle);
    }
  }
  return handles;
}

void CallEnd::Impl::drain_discovery() {
  // Each callback may close this end.
  if (listener == nullptr) {
    return;
  }
  look_around();
  registry.set_matched(matched());
  // An instance that leaves may have answered just before.
  drain_replies();
  announce(registry.changes());
}

void CallEnd::Impl::look_around() {
  Discovery::News news = discovery->drain(registry);
  for (const std::string& uuid : news.uuids) {
    open_requests(uuid);
  }
  ignored.insert(ignored.end(), std::make_move_iterator(news.ignored.begin()),
                 std::make_move_iterator(news.ignored.end()));
}

void CallEnd::Impl::announce(const registry::Registry::Changes& changes) {
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
  constexpr std::size_t most_remembered = 256;
  if (strangers.size() >= most_remembered) {
    strangers.clear();
  }
  if (strangers.insert(taken.writer).second) {
    listener->on_ignored(fmt::format(
        "{}: a reply to call {} in the name of instance {} is dropped: it does not come "
        "from that instance's writer",
        reply.key.to_string(), reply.call.to_string(), reply.instance.to_string()));
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
  const auto writer = impl_->requests.find(canonical_uuid(request.uuid));
  if (writer == impl_->requests.end()) {
    return tl::unexpected(fmt::format("no instance has shown up on fabric '{}' for UUID {}",
                                      impl_->fabric(), request.uuid));
  }
  const auto written = writer->second.write(request);
  if (written) {
    impl_->wrote(writer->second);
  }
  return written;
}

void CallEnd::withdraw(const RequestKey& key, const std::string& uuid) {
  const auto writer = impl_->requests.find(canonical_uuid(uuid));
  if (writer != impl_->requests.end()) {
    writer->second.withdraw(Request{.key = key.key, .call = {.epoch = key.epoch}});
    impl_->wrote(writer->second);
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
