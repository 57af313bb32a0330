#include <google/protobuf/descriptor.pb.h>

#include "base/text/cp1252.hpp"
#include "fabric/cases.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/recording/codec.hpp"
#include "tools/recording/proto_fields.hpp"

namespace millrace::tools::recording {

namespace {

/// Fields of type string hold UTF-8. Texts of the fabric are, by convention; where one is not, its
/// bytes are the controller's.
std::string utf8(const std::string& text) {
  return base::text::is_utf8(text) ? text : base::text::to_utf8(text);
}

/// A UUID that is no UTF-8 is kept as it is, too: by its bytes it is known.
template <typename Message>
void put_uuid(Message& message, const std::string& uuid) {
  if (base::text::is_utf8(uuid)) {
    message.set_uuid(uuid);
  } else {
    message.set_uuid(base::text::to_utf8(uuid));
    message.set_uuid_bytes(uuid);
  }
}

void put_value(proto::Value& message, const fabric::Value& value) {
  message.set_name(utf8(value.name));
  put_enum<proto::ValueType_IsValid>(message, &proto::Value::set_type,
                                     proto::Value::kTypeFieldNumber, value.type);
  put_enum<proto::Quality_IsValid>(message, &proto::Value::set_quality,
                                   proto::Value::kQualityFieldNumber, value.quality);
  message.set_at(nanoseconds(value.at));
  if (value.is_array) {
    message.set_is_array(true);
  }
  const fabric::Cases put{
      [&](const std::vector<std::int64_t>& all) {
        message.mutable_integer()->Add(all.begin(), all.end());
      },
      [&](const std::vector<double>& all) { message.mutable_real()->Add(all.begin(), all.end()); },
      [&](const std::vector<std::string>& all) {
        message.mutable_text()->Add(all.begin(), all.end());
      }};
  std::visit(put, value.elements);
  if (!value.reason.empty()) {
    message.set_reason(utf8(value.reason));
  }
}

/// Turns the sample of an entry into its message.
class ToMessage {
 public:
  explicit ToMessage(const Entry& entry) : entry_(entry) {}

  proto::Request operator()(const fabric::Request& request) const {
    proto::Request message;
    put_key(message, request.key);
    put_call(message, request.call);
    message.set_attempt(request.attempt);
    message.set_assigned(bytes_of(request.assigned));
    put_uuid(message, request.uuid);
    put_text(message, request.text, entry_);
    message.set_state(request.state);
    message.set_deadline(nanoseconds(request.deadline));
    message.set_seen(nanoseconds(request.seen));
    message.set_dispatched(nanoseconds(request.dispatched));
    message.set_replayed(request.replayed);
    if (request.succeeds != 0) {
      message.set_succeeds(request.succeeds);
    }
    if (request.may_wait) {
      message.set_may_wait(true);
    }
    return message;
  }

  proto::Reply operator()(const fabric::Reply& reply) const {
    proto::Reply message;
    put_key(message, reply.key);
    message.set_instance(bytes_of(reply.instance));
    put_call(message, reply.call);
    message.set_attempt(reply.attempt);
    put_enum<proto::ReplyKind_IsValid>(message, &proto::Reply::set_kind,
                                       proto::Reply::kKindFieldNumber, reply.kind);
    put_enum<proto::ServiceCode_IsValid>(message, &proto::Reply::set_code,
                                         proto::Reply::kCodeFieldNumber, reply.code);
    put_text(message, reply.text, entry_);
    message.set_state(reply.state);
    message.set_received(nanoseconds(reply.received));
    message.set_started(nanoseconds(reply.started));
    message.set_answered(nanoseconds(reply.answered));
    message.set_replayed(reply.replayed);
    put_uuid(message, entry_.uuid);
    return message;
  }

  proto::Withdrawal operator()(const Withdrawal& withdrawal) const {
    proto::Withdrawal message;
    put_key(message, withdrawal.key);
    put_call(message, withdrawal.call);
    put_uuid(message, entry_.uuid);
    message.set_instance(bytes_of(withdrawal.instance));
    return message;
  }

  proto::ChannelStatus operator()(const fabric::ChannelStatus& status) const {
    proto::ChannelStatus message;
    put_key(message, status.key);
    put_enum<proto::ChannelState_IsValid>(message, &proto::ChannelStatus::set_state,
                                          proto::ChannelStatus::kStateFieldNumber, status.state);
    message.set_since(nanoseconds(status.since));
    put_call(message, status.call);
    message.set_attempt(status.attempt);
    message.set_instance(bytes_of(status.instance));
    put_uuid(message, status.uuid);
    message.set_reason(utf8(status.reason));
    message.set_calls(status.calls);
    message.set_answered(status.answered);
    message.set_withdrawn(status.withdrawn);
    message.set_repeated_calls(status.repeated);
    message.set_late(status.late);
    message.set_failed(status.failed);
    return message;
  }

  proto::Instance operator()(const InstanceNews& news) const {
    const fabric::InstanceIdentity& identity = news.identity;
    proto::Instance message;
    put_enum<proto::InstanceChange_IsValid>(message, &proto::Instance::set_change,
                                            proto::Instance::kChangeFieldNumber, news.change);
    message.set_instance(bytes_of(identity.id));
    put_uuid(message, entry_.uuid);
    message.set_name(utf8(identity.name));
    message.set_description(utf8(identity.description));
    message.set_version(utf8(identity.version));
    message.set_host(utf8(identity.host));
    message.set_pid(identity.pid);
    for (const fabric::ChannelScope& scope : identity.channels) {
      message.add_channel(fabric::format_channel_scope(scope));
    }
    put_enum<proto::Delivery_IsValid>(message, &proto::Instance::set_delivery,
                                      proto::Instance::kDeliveryFieldNumber, identity.delivery);
    if (!identity.certificate.empty()) {
      message.set_certificate(utf8(identity.certificate));
    }
    message.set_awaits_response(identity.awaited == fabric::Awaited::response);
    message.set_concurrency(identity.concurrency);
    message.set_draining(identity.draining);
    return message;
  }

  proto::InstanceStatus operator()(const fabric::InstanceStatus& status) const {
    proto::InstanceStatus message;
    message.set_instance(bytes_of(status.instance));
    put_uuid(message, entry_.uuid);
    message.set_running(status.running);
    message.set_waiting(status.waiting);
    message.set_answered(status.answered);
    message.set_failed(status.failed);
    message.set_repeated_calls(status.repeated);
    message.set_cancelled(status.cancelled);
    message.set_declined(status.declined);
    message.set_mean_ns(static_cast<std::uint64_t>(status.mean.count()));
    message.set_started(nanoseconds(status.started));
    message.set_last_call(nanoseconds(status.last_call));
    return message;
  }

  proto::MachineStatus operator()(const fabric::MachineStatus& status) const {
    proto::MachineStatus message;
    message.set_machine(utf8(status.machine));
    message.set_connected(status.connected);
    message.set_since(nanoseconds(status.since));
    message.set_address(utf8(status.address));
    message.set_reason(utf8(status.reason));
    message.set_channels(status.channels);
    message.set_poll_ns(static_cast<std::uint64_t>(status.poll.count()));
    message.set_requests_per_second(status.requests_per_second);
    message.set_round_trip_ns(static_cast<std::uint64_t>(status.round_trip.count()));
    message.set_host(utf8(status.host));
    message.set_pid(status.pid);
    message.set_version(utf8(status.version));
    message.set_epoch(status.epoch);
    message.set_gateway(bytes_of(status.gateway));
    message.set_claimed(nanoseconds(status.claimed));
    message.mutable_claims()->Add(status.claims.begin(), status.claims.end());
    return message;
  }

  proto::Event operator()(const fabric::Event& event) const {
    proto::Event message;
    put_key(message, event.key);
    put_call(message, event.call);
    message.set_attempt(event.attempt);
    put_enum<proto::EventKind_IsValid>(message, &proto::Event::set_kind,
                                       proto::Event::kKindFieldNumber, event.kind);
    message.set_at(nanoseconds(event.at));
    message.set_instance(bytes_of(event.instance));
    put_uuid(message, event.uuid);
    put_text(message, event.text, entry_);
    message.set_state(event.state);
    message.set_detail(utf8(event.detail));
    message.set_replayed(event.replayed);
    return message;
  }

  proto::Command operator()(const fabric::Command& command) const {
    proto::Command message;
    message.set_token(bytes_of(command.id));
    put_enum<proto::CommandKind_IsValid>(message, &proto::Command::set_kind,
                                         proto::Command::kKindFieldNumber, command.kind);
    put_key(message, command.key);
    put_call(message, command.call);
    put_text(message, command.text, entry_);
    message.set_state(command.state);
    message.set_instance(bytes_of(command.instance));
    message.set_issuer(utf8(command.issuer));
    message.set_at(nanoseconds(command.at));
    return message;
  }

  proto::Outcome operator()(const fabric::Outcome& outcome) const {
    proto::Outcome message;
    message.set_responder(bytes_of(outcome.responder));
    message.set_token(bytes_of(outcome.command));
    message.set_done(outcome.done);
    message.set_detail(utf8(outcome.detail));
    message.set_at(nanoseconds(outcome.at));
    return message;
  }

  proto::DataSample operator()(const fabric::DataSample& sample) const {
    proto::DataSample message;
    put_key(message, sample.key);
    message.set_group(utf8(sample.group));
    message.set_at(nanoseconds(sample.at));
    message.set_period_ns(static_cast<std::uint64_t>(sample.period.count()));
    message.set_wanted_ns(static_cast<std::uint64_t>(sample.wanted.count()));
    for (const fabric::Value& value : sample.values) {
      put_value(*message.add_value(), value);
    }
    message.set_replayed(sample.replayed);
    return message;
  }

  proto::ProgramEvent operator()(const fabric::ProgramEvent& event) const {
    proto::ProgramEvent message;
    put_key(message, event.key);
    put_enum<proto::ProgramEventKind_IsValid>(message, &proto::ProgramEvent::set_kind,
                                              proto::ProgramEvent::kKindFieldNumber, event.kind);
    message.set_at(nanoseconds(event.at));
    message.set_started(nanoseconds(event.started));
    message.set_program(event.program);
    message.set_error(event.error);
    if (event.parts) {
      message.set_parts(*event.parts);
    }
    message.set_mode(event.mode);
    message.set_detail(utf8(event.detail));
    message.set_replayed(event.replayed);
    return message;
  }

  proto::Notice operator()(const NoticeNews& news) const {
    const fabric::Notice& notice = news.notice;
    proto::Notice message;
    message.set_responder(bytes_of(notice.key.responder));
    message.set_kind(utf8(notice.key.kind));
    message.set_subject(utf8(notice.key.subject));
    put_enum<proto::NoticeLevel_IsValid>(message, &proto::Notice::set_level,
                                         proto::Notice::kLevelFieldNumber, notice.level);
    message.set_text(utf8(notice.text));
    message.set_advice(utf8(notice.advice));
    message.set_since(nanoseconds(notice.since));
    message.set_program(utf8(notice.program));
    message.set_host(utf8(notice.host));
    message.set_pid(notice.pid);
    message.set_over(news.over);
    return message;
  }

 private:
  const Entry& entry_;
};

}  // namespace

std::string encode(const Entry& entry) {
  return std::visit(
      [&](const auto& sample) { return ToMessage(entry)(sample).SerializeAsString(); },
      entry.sample);
}

std::string schema_name(const Entry& entry) {
  return std::visit(
      [&](const auto& sample) {
        return decltype(ToMessage(entry)(sample))::descriptor()->full_name();
      },
      entry.sample);
}

const std::string& descriptor_set() {
  static const std::string bytes = [] {
    google::protobuf::FileDescriptorSet set;
    proto::Request::descriptor()->file()->CopyTo(set.add_file());
    return set.SerializeAsString();
  }();
  return bytes;
}

}  // namespace millrace::tools::recording
