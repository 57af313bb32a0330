// Fields that the messages of idl/recording.proto share. For the codec only.
#pragma once

#include <algorithm>
#include <string>

#include "idl/recording.pb.h"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

namespace proto = millrace::recording;

// The enumerations of fabric/messages, fabric/command and entry repeat those of the messages in the
// same order.
static_assert(static_cast<int>(fabric::ServiceCode::refused) == proto::CODE_REFUSED);
static_assert(static_cast<int>(fabric::ReplyKind::declined) == proto::REPLY_DECLINED);
static_assert(static_cast<int>(fabric::ChannelState::held) == proto::CHANNEL_HELD);
static_assert(static_cast<int>(fabric::EventKind::held) == proto::EVENT_HELD);
static_assert(static_cast<int>(fabric::Delivery::at_most_once) == proto::AT_MOST_ONCE);
static_assert(static_cast<int>(fabric::CommandKind::ping) == proto::COMMAND_PING);
static_assert(static_cast<int>(Change::gone) == proto::INSTANCE_GONE);
static_assert(static_cast<int>(fabric::ValueType::string) == proto::VALUE_STRING);
static_assert(static_cast<int>(fabric::Quality::refused) == proto::QUALITY_REFUSED);
static_assert(static_cast<int>(fabric::ProgramEventKind::resumed) == proto::PROGRAM_RESUMED);
static_assert(static_cast<int>(fabric::NoticeLevel::problem) == proto::NOTICE_PROBLEM);

/// An enumerator of a newer version, which is none of ours: its number is what proto2 keeps of it.
template <bool (*is_valid)(int), typename Message, typename Proto, typename Value>
void put_enum(Message& message, void (Message::*set)(Proto), int field, Value value) {
  const int number = static_cast<int>(value);
  if (is_valid(number)) {
    (message.*set)(static_cast<Proto>(number));
  } else {
    message.GetReflection()->MutableUnknownFields(&message)->AddVarint(
        field, static_cast<std::uint64_t>(number));
  }
}
/// The word for it is "unknown"; it is not taken for the first one.
template <typename Value, typename Message>
Value enum_of(const Message& message, int field, int known) {
  const auto& unknown = message.GetReflection()->GetUnknownFields(message);
  for (int i = 0; i < unknown.field_count(); ++i) {
    if (unknown.field(i).number() == field) {
      return static_cast<Value>(0xff);
    }
  }
  return static_cast<Value>(known);
}

template <typename Message>
std::string uuid_of(const Message& message) {
  return message.has_uuid_bytes() ? message.uuid_bytes() : message.uuid();
}

inline std::string bytes_of(const fabric::InstanceId& id) {
  return {id.bytes.begin(), id.bytes.end()};
}

/// A foreign or damaged file may hold fewer bytes, or more.
inline fabric::InstanceId instance_of(const std::string& bytes) {
  fabric::InstanceId id;
  std::copy_n(bytes.begin(), std::min(bytes.size(), id.bytes.size()), id.bytes.begin());
  return id;
}

inline std::int64_t nanoseconds(fabric::Time time) {
  return time.time_since_epoch().count();
}
inline fabric::Time time_of(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

template <typename Message>
void put_key(Message& message, const fabric::ChannelKey& key) {
  message.set_machine(key.machine);
  message.set_channel(key.channel);
}
template <typename Message>
fabric::ChannelKey key_of(const Message& message) {
  return {message.machine(), static_cast<std::uint16_t>(message.channel())};
}

template <typename Message>
void put_call(Message& message, const fabric::CallId& call) {
  message.mutable_call()->set_epoch(call.epoch);
  message.mutable_call()->set_number(call.number);
}
template <typename Message>
fabric::CallId call_id_of(const Message& message) {
  return {message.call().epoch(), message.call().number()};
}

/// The text, or its size where it is withheld.
template <typename Message>
void put_text(Message& message, const std::string& text, const Entry& entry) {
  if (entry.withheld) {
    message.set_text_size(*entry.withheld);
  } else {
    message.set_text(text);
  }
}
template <typename Message>
std::string take_text(const Message& message, Entry& entry) {
  if (message.has_text_size()) {
    entry.withheld = message.text_size();
  }
  return message.text();
}

}  // namespace millrace::tools::recording
