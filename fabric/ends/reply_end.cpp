#include "fabric/ends/reply_end.hpp"

#include <mutex>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "fabric/dds/post_once.hpp"
#include "fabric/dds/serial_listener.hpp"
#include "fabric/recent_keys.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/registry/identity_text.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

namespace {

/// The last answer to so many channels of gateways stays for who finds this end later. Far more
/// than ever wait; about 1 kB each.
constexpr std::size_t most_answered = 4096;

}  // namespace

struct ReplyEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, InstanceIdentity own_identity,
       ReplyEndListener& own_listener)
      : participant(own_participant),
        identity(std::move(own_identity)),
        listener(&own_listener),
        replies(participant,
                wire::service_partition(own_participant.options().fabric, identity.uuid),
                {.user_data = registry::format_instance(identity.id)}) {}

  void open(const boost::asio::any_io_executor& executor);
  void open_directly();
  void read(const dds::Listener& on_request);
  void close();
  void drain();
  void tell(const wire::Taken<Request>& taken);
  void decline(const wire::Taken<Request>& taken);
  tl::expected<void, std::string> answer(const Reply& reply);

  dds::Participant& participant;
  const InstanceIdentity identity;
  /// Null once the end is closed.
  ReplyEndListener* listener;
  wire::Writer<Reply> replies;
  std::mutex answering;
  RecentKeys answered{most_answered};
  /// What gateways have asked that may: who may not says nothing about that. Only with trust.
  RecentKeys asked{most_answered};
  // One of them, before the reader that wakes it.
  std::optional<dds::PostOnce> post;
  std::optional<dds::SerialListener> serial;
  std::optional<wire::Reader<Request>> requests;
};

void ReplyEnd::Impl::open(const boost::asio::any_io_executor& executor) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  const dds::Listener on_request(dds_create_listener(nullptr));
  post->listen_for_data(on_request.get());
  read(on_request);
}

void ReplyEnd::Impl::open_directly() {
  serial.emplace([this] { drain(); });
  const dds::Listener on_request(dds_create_listener(nullptr));
  serial->listen_for_data(on_request.get());
  read(on_request);
  serial->open();
}

void ReplyEnd::Impl::read(const dds::Listener& on_request) {
  requests.emplace(
      participant,
      wire::mailbox_partition(participant.options().fabric, identity.uuid, identity.id),
      // With trust all, so that who is not believed does not push out what a gateway has asked.
      participant.badges() != nullptr ? wire::Keep::all : wire::Keep::last,
      wire::EndpointOptions{.user_data = registry::format_identity(identity),
                            .listener = on_request.get(),
                            .doubtful = true});
}

void ReplyEnd::Impl::close() {
  requests->silence();
  listener = nullptr;
  requests.reset();
}

void ReplyEnd::Impl::drain() {
  // Each callback may close this end.
  while (listener != nullptr) {
    const auto batch = requests->take();
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<Request>& taken : batch) {
      if (listener != nullptr) {
        tell(taken);
      }
    }
  }
}

void ReplyEnd::Impl::tell(const wire::Taken<Request>& taken) {
  if (taken.standing != Standing::believed) {
    decline(taken);
    return;
  }
  if (participant.badges() != nullptr && taken.valid) {
    const std::lock_guard lock(answering);
    asked.use(key_of(taken.value));
  }
  switch (taken.presence) {
    // Its request may be here too, untaken: whoever withdraws, or leaves, overtakes it.
    case wire::Presence::withdrawn:
      listener->on_withdrawn(key_of(taken.value));
      break;
    case wire::Presence::orphaned:
      listener->on_orphaned(key_of(taken.value));
      break;
    case wire::Presence::alive:
      // The mailbox is this instance's alone; who writes for another one into it is mistaken.
      if (taken.valid && taken.value.assigned == identity.id) {
        listener->on_request(taken.value);
      }
      break;
  }
}

void ReplyEnd::Impl::decline(const wire::Taken<Request>& taken) {
  const Request& request = taken.value;
  requests->witness().complain(taken.writer, wire::claim_of(request), wire::request_topic.name);
  if (!taken.valid || taken.presence != wire::Presence::alive || request.assigned != identity.id) {
    return;
  }
  {
    // What is said of the calls of a gateway that may ask is for it to hear alone.
    const std::lock_guard lock(answering);
    if (asked.knows(key_of(request))) {
      return;
    }
  }
  static_cast<void>(answer({.key = request.key,
                            .instance = identity.id,
                            .call = request.call,
                            .attempt = request.attempt,
                            .kind = ReplyKind::declined,
                            .code = ServiceCode::refused,
                            .text = "the certificate of who asks does not name this machine"}));
}

tl::expected<void, std::string> ReplyEnd::Impl::answer(const Reply& reply) {
  const std::lock_guard lock(answering);
  if (const auto old = answered.use(key_of(reply))) {
    replies.let_go({.key = old->key, .instance = identity.id, .call = {.epoch = old->epoch}});
  }
  return replies.write(reply);
}

namespace {

InstanceIdentity checked(InstanceIdentity identity) {
  if (const auto reason = registry::check_identity(identity)) {
    throw std::invalid_argument(
        fmt::format("the instance '{}' cannot join the fabric: {}", identity.name, *reason));
  }
  return identity;
}

}  // namespace

ReplyEnd::ReplyEnd(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                   InstanceIdentity identity, ReplyEndListener& listener)
    : impl_(std::make_shared<Impl>(participant, checked(std::move(identity)), listener)) {
  impl_->open(executor);
}

ReplyEnd::ReplyEnd(dds::Participant& participant, InstanceIdentity identity,
                   ReplyEndListener& listener)
    : impl_(std::make_shared<Impl>(participant, checked(std::move(identity)), listener)) {
  impl_->open_directly();
}

ReplyEnd::~ReplyEnd() {
  impl_->close();
}

tl::expected<void, std::string> ReplyEnd::publish(const Reply& reply) {
  if (reply.kind == ReplyKind::final && reply.state == 0 &&
      impl_->identity.awaited == Awaited::response_state) {
    return tl::unexpected(std::string("a final reply of state 0 would not release the program"));
  }
  return impl_->answer(reply);
}

void ReplyEnd::set_draining(bool draining) {
  InstanceIdentity identity = impl_->identity;
  identity.draining = draining;
  impl_->requests->set_user_data(registry::format_identity(identity));
}

const InstanceIdentity& ReplyEnd::identity() const {
  return impl_->identity;
}

}  // namespace millrace::fabric::ends
