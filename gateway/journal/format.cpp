#include "gateway/journal/format.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <zlib.h>

#include "fabric/cases.hpp"
#include "idl/journal.pb.h"

namespace millrace::gateway::journal {

namespace {

static_assert(std::endian::native == std::endian::little, "u32 is copied as it lies in memory");

namespace pb = millrace::journal;

constexpr std::size_t head = 8;
constexpr std::uint32_t longest = 64 * 1024;

void put(pb::CallId& out, const fabric::CallId& in) {
  out.set_epoch(in.epoch);
  out.set_number(in.number);
}

fabric::CallId get(const pb::CallId& in) {
  return {in.epoch(), in.number()};
}

std::string bytes_of(const fabric::InstanceId& id) {
  return {id.bytes.begin(), id.bytes.end()};
}

fabric::InstanceId instance_of(const std::string& bytes) {
  fabric::InstanceId id;
  std::copy_n(bytes.begin(), std::min(bytes.size(), id.bytes.size()), id.bytes.begin());
  return id;
}

void put(pb::Dispatched& out, const DispatchedEntry& in) {
  put(*out.mutable_call(), in.call);
  out.set_machine(in.key.machine);
  out.set_channel(in.key.channel);
  out.set_uuid(in.request.uuid);
  out.set_text(in.request.text);
  out.set_state(in.request.state);
  out.set_seen(in.seen.time_since_epoch().count());
  out.set_at_most_once(in.delivery == fabric::Delivery::at_most_once);
  out.set_attempt(in.attempt);
  out.set_instance(bytes_of(in.instance));
  out.set_awaits_response(in.completion_signal == fabric::CompletionSignal::response);
}

DispatchedEntry get(const pb::Dispatched& in) {
  DispatchedEntry out;
  out.call = get(in.call());
  out.key = {in.machine(), static_cast<std::uint16_t>(in.channel())};
  out.request = {in.uuid(), in.text(), in.state()};
  out.seen = fabric::Time(std::chrono::nanoseconds(in.seen()));
  out.delivery =
      in.at_most_once() ? fabric::Delivery::at_most_once : fabric::Delivery::at_least_once;
  out.attempt = in.attempt();
  out.instance = instance_of(in.instance());
  out.completion_signal = in.awaits_response() ? fabric::CompletionSignal::response
                                               : fabric::CompletionSignal::response_state;
  return out;
}

void put(pb::Answered& out, const AnsweredEntry& in) {
  put(*out.mutable_call(), in.call);
  out.set_instance(bytes_of(in.answer.instance));
  out.set_attempt(in.answer.attempt);
  out.set_text(in.answer.text);
  out.set_state(in.answer.state);
}

AnsweredEntry get(const pb::Answered& in) {
  return {get(in.call()), {instance_of(in.instance()), in.attempt(), in.text(), in.state()}};
}

template <typename Out>
void put_key(Out& out, const fabric::ChannelKey& key) {
  out.set_machine(key.machine);
  out.set_channel(key.channel);
}

template <typename In>
fabric::ChannelKey key_of(const In& in) {
  return {in.machine(), static_cast<std::uint16_t>(in.channel())};
}

void put(pb::Message& out, const MessageEntry& in) {
  put_key(out, in.key);
  out.set_number(in.number);
  out.set_element(in.element);
  out.set_text(in.text);
  out.set_seen(in.seen.time_since_epoch().count());
}

MessageEntry get(const pb::Message& in) {
  return {key_of(in), in.number(), in.element(), in.text(),
          fabric::Time(std::chrono::nanoseconds(in.seen()))};
}

void put(pb::LastGet& out, const LastGetEntry& in) {
  put_key(out, in.key);
  out.set_element(in.element);
  out.set_number(in.number);
}

void put_sentence(pb::Sentence& out, const fabric::Message& in) {
  out.set_code(in.code);
  for (const fabric::Message& argument : in.arguments) {
    pb::Sentence& to = *out.add_arguments();
    put_sentence(to, argument);
    to.set_text(argument.text);
  }
}

fabric::Message sentence_of(const pb::Sentence& in, const std::string& text) {
  fabric::Message sentence(text);
  sentence.code = in.code();
  for (const pb::Sentence& argument : in.arguments()) {
    sentence.arguments.push_back(sentence_of(argument, argument.text()));
  }
  return sentence;
}

void put(pb::Standing& out, const BlockedEntry& in) {
  put_key(out, in.key);
  if (in.state == fabric::ChannelState::held) {
    out.set_held(true);
  } else if (in.state == fabric::ChannelState::unserved) {
    out.set_unserved(true);
  } else {
    return;
  }
  put(*out.mutable_call(), in.call);
  out.set_uuid(in.uuid);
  out.set_since(in.since.time_since_epoch().count());
  out.set_reason(in.reason.text);
  if (!in.reason.code.empty()) {
    put_sentence(*out.mutable_reason_message(), in.reason);
  }
}

BlockedEntry get(const pb::Standing& in) {
  return {.key = key_of(in),
          .state = in.held()       ? fabric::ChannelState::held
                   : in.unserved() ? fabric::ChannelState::unserved
                                   : fabric::ChannelState::idle,
          .call = get(in.call()),
          .uuid = in.uuid(),
          .since = fabric::Time(std::chrono::nanoseconds(in.since())),
          .reason = sentence_of(in.reason_message(), in.reason())};
}

pb::Record message_of(const JournalEntry& entry) {
  pb::Record record;
  std::visit(fabric::Cases{
                 [&](const NumbersEntry& in) {
                   record.mutable_numbers()->set_epoch(in.epoch);
                   record.mutable_numbers()->set_reserved(in.reserved);
                 },
                 [&](const DispatchedEntry& in) { put(*record.mutable_dispatched(), in); },
                 [&](const InterimEntry& in) {
                   put(*record.mutable_interim()->mutable_call(), in.call);
                   record.mutable_interim()->set_state(in.state);
                 },
                 [&](const AnsweredEntry& in) { put(*record.mutable_answered(), in); },
                 [&](const ClearingEntry& in) { put(*record.mutable_clearing(), in.call); },
                 [&](const EndedEntry& in) { put(*record.mutable_ended(), in.call); },
                 [&](const MessageEntry& in) { put(*record.mutable_message(), in); },
                 [&](const MessageEndedEntry& in) {
                   put_key(*record.mutable_message_ended(), in.key);
                   record.mutable_message_ended()->set_number(in.number);
                 },
                 [&](const LastGetEntry& in) { put(*record.mutable_last_get(), in); },
                 [&](const BlockedEntry& in) { put(*record.mutable_standing(), in); },
             },
             entry);
  return record;
}

std::optional<JournalEntry> entry_of(const pb::Record& record) {
  switch (record.entry_case()) {
    case pb::Record::kNumbers:
      return NumbersEntry{record.numbers().epoch(), record.numbers().reserved()};
    case pb::Record::kDispatched:
      return get(record.dispatched());
    case pb::Record::kInterim:
      return InterimEntry{get(record.interim().call()), record.interim().state()};
    case pb::Record::kAnswered:
      return get(record.answered());
    case pb::Record::kClearing:
      return ClearingEntry{get(record.clearing())};
    case pb::Record::kEnded:
      return EndedEntry{get(record.ended())};
    case pb::Record::kMessage:
      return get(record.message());
    case pb::Record::kMessageEnded:
      return MessageEndedEntry{key_of(record.message_ended()), record.message_ended().number()};
    case pb::Record::kLastGet:
      return LastGetEntry{key_of(record.last_get()), record.last_get().element(),
                          record.last_get().number()};
    case pb::Record::kStanding:
      return get(record.standing());
    case pb::Record::ENTRY_NOT_SET:
      break;
  }
  return {};
}

std::uint32_t checksum(std::string_view length, std::string_view message) {
  const auto* first = reinterpret_cast<const Bytef*>(length.data());
  const auto* second = reinterpret_cast<const Bytef*>(message.data());
  uLong crc = crc32(0, first, static_cast<uInt>(length.size()));
  crc = crc32(crc, second, static_cast<uInt>(message.size()));
  return static_cast<std::uint32_t>(crc);
}

std::string u32(std::uint32_t value) {
  std::string out(sizeof value, '\0');
  std::memcpy(out.data(), &value, sizeof value);
  return out;
}

std::uint32_t u32(std::string_view bytes) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

/// The record at the beginning of `rest` and its length; a damage in words otherwise.
struct Step {
  std::optional<JournalEntry> entry;
  std::size_t length = 0;
  std::string damage;
};

Step read_one(std::string_view rest) {
  if (rest.size() < head) {
    return {{}, 0, "a record is cut short"};
  }
  const std::uint32_t length = u32(rest.substr(0, 4));
  if (length == 0 || length > longest) {
    return {{}, 0, fmt::format("a record has the impossible length of {} bytes", length)};
  }
  if (rest.size() - head < length) {
    return {{}, 0, "a record is cut short"};
  }
  const std::string_view message = rest.substr(head, length);
  if (checksum(rest.substr(0, 4), message) != u32(rest.substr(4, 4))) {
    return {{}, 0, "a record's checksum is wrong"};
  }
  pb::Record record;
  if (!record.ParseFromArray(message.data(), static_cast<int>(length))) {
    return {{}, 0, "a record is not a message"};
  }
  return {entry_of(record), head + length, {}};
}

}  // namespace

std::string encode(const JournalEntry& entry) {
  const std::string message = message_of(entry).SerializeAsString();
  const std::string length = u32(static_cast<std::uint32_t>(message.size()));
  return length + u32(checksum(length, message)) + message;
}

std::string encode_file(const std::vector<JournalEntry>& entries) {
  std::string file(magic);
  for (const JournalEntry& entry : entries) {
    file += encode(entry);
  }
  return file;
}

Contents decode(std::string_view file) {
  Contents contents;
  if (file.empty()) {
    return contents;
  }
  if (!file.starts_with(magic)) {
    contents.damage = "it does not begin like a journal of this version";
    return contents;
  }
  contents.good = magic.size();
  while (contents.good < file.size()) {
    Step step = read_one(file.substr(contents.good));
    if (!step.damage.empty()) {
      contents.damage = std::move(step.damage);
      break;
    }
    if (step.entry) {
      contents.entries.push_back(std::move(*step.entry));
    }
    contents.good += step.length;
  }
  return contents;
}

}  // namespace millrace::gateway::journal
