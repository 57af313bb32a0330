#include "fabric/call_end.hpp"

#include <map>

#include <fmt/format.h>

#include "fabric/discovery.hpp"
#include "fabric/reader.hpp"
#include "fabric/waker.hpp"
#include "fabric/writer.hpp"

namespace millrace::fabric {

struct CallEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(Participant& own_participant, CallEndListener& own_listener)
      : participant(own_participant),
        listener(&own_listener),
        channels(own_participant, own_participant.options().fabric),
        machines(own_participant, own_participant.options().fabric),
        events(own_participant, own_participant.options().fabric) {
    events.hold({});
  }

  void open(const boost::asio::any_io_executor& executor);
  void close();
  void open_requests(const std::string& uuid);
  void drain_discovery();
  void drain_replies();
  void announce(const std::vector<std::string>& ignored, const Registry::Changes& changes);
  [[nodiscard]] std::set<EndpointHandle> matched() const;
  [[nodiscard]] const std::string& fabric() const { return participant.options().fabric; }

  /// Calls the listener, which may end this end in any of its functions.
  template <typename Tell>
  void tell(Tell tell) {
    if (listener != nullptr) {
      tell();
    }
  }

  Participant& participant;
  /// Null once the end is closed.
  CallEndListener* listener;
  Registry registry;
  // Before the entities whose listeners wake them.
  std::optional<Waker> discovery_waker;
  std::optional<Waker> reply_waker;
  std::optional<Discovery> discovery;
  std::optional<Reader<Reply>> replies;
  /// By canonical UUID. They stay when the last instance leaves, because a pending call waits in
  /// them for the next one.
  std::map<std::string, Writer<Request>> requests;
  Writer<ChannelStatus> channels;
  Writer<MachineStatus> machines;
  Writer<Event> events;
};

void CallEnd::Impl::open(const boost::asio::any_io_executor& executor) {
  discovery_waker.emplace(executor, weak_from_this(), [this] { drain_discovery(); });
  reply_waker.emplace(executor, weak_from_this(), [this] { drain_replies(); });

  const Listener on_reply(dds_create_listener(nullptr));
  reply_waker->listen_for_data(on_reply.get());
  discovery_waker->listen_for_matches(on_reply.get());
  replies.emplace(participant, all_services(fabric()), Keep::last,
                  EndpointOptions{.listener = on_reply.get()});

  const Listener on_endpoint(dds_create_listener(nullptr));
  discovery_waker->listen_for_data(on_endpoint.get());
  discovery.emplace(participant, on_endpoint.get());
}

void CallEnd::Impl::close() {
  listener = nullptr;
  requests.clear();
  replies.reset();
  discovery.reset();
}

void CallEnd::Impl::open_requests(const std::string& uuid) {
  if (requests.contains(uuid)) {
    return;
  }
  const Listener on_match(dds_create_listener(nullptr));
  discovery_waker->listen_for_matches(on_match.get());
  requests.try_emplace(uuid, participant, service_partition(fabric(), uuid),
                       EndpointOptions{.listener = on_match.get()});
}

std::set<EndpointHandle> CallEnd::Impl::matched() const {
  std::set<EndpointHandle> handles;
  for (const EndpointHandle handle : replies->matched()) {
    handles.insert(handle);
  }
  for (const auto& [uuid, writer] : requests) {
    for (const EndpointHandle handle : writer.matched()) {
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
  const Discovery::News news = discovery->drain(registry);
  for (const std::string& uuid : news.uuids) {
    open_requests(uuid);
  }
  registry.set_matched(matched());
  // An instance that leaves may have answered just before.
  drain_replies();
  announce(news.ignored, registry.changes());
}

void CallEnd::Impl::announce(const std::vector<std::string>& ignored,
                             const Registry::Changes& changes) {
  for (const std::string& reason : ignored) {
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
    for (const Taken<Reply>& taken : batch) {
      if (taken.valid) {
        tell([&] { listener->on_reply(taken.value); });
      }
    }
  }
}

CallEnd::CallEnd(Participant& participant, boost::asio::any_io_executor executor,
                 CallEndListener& listener)
    : impl_(std::make_shared<Impl>(participant, listener)) {
  impl_->open(executor);
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
  return writer->second.write(request);
}

void CallEnd::withdraw(const RequestKey& key, const std::string& uuid) {
  const auto writer = impl_->requests.find(canonical_uuid(uuid));
  if (writer != impl_->requests.end()) {
    writer->second.withdraw(Request{.key = key.key, .call = {.epoch = key.epoch}});
  }
}

tl::expected<void, std::string> CallEnd::publish(const ChannelStatus& status) {
  return impl_->channels.write(status);
}

tl::expected<void, std::string> CallEnd::publish(const MachineStatus& status) {
  return impl_->machines.write(status);
}

tl::expected<void, std::string> CallEnd::publish(const Event& event) {
  // Nobody can ask for it later.
  if (!impl_->events.has_readers()) {
    return {};
  }
  return impl_->events.write(event);
}

void CallEnd::let_go(const ChannelKey& key) {
  impl_->channels.let_go(ChannelStatus{.key = key});
}

void CallEnd::let_go(const MachineStatus& status) {
  impl_->machines.let_go(status);
}

}  // namespace millrace::fabric
