#include "fabric/wire/foreign_replies.hpp"

#include <cstring>

#include "base/program/barrier.hpp"
#include "fabric/messages.hpp"
#include "idl/millrace.h"

namespace millrace::fabric::wire {

namespace {

/// The value of an enumeration: a foreign one may have a value without a name, and C++ does not
/// allow to read that as an enumeration, not even with std::bit_cast.
template <typename Enumeration>
std::underlying_type_t<Enumeration> number_of(const Enumeration& value) {
  std::underlying_type_t<Enumeration> number{};
  std::memcpy(&number, &value, sizeof number);
  return number;
}

RequestKey key_of(const millrace_Reply& reply) {
  RequestKey key{{reply.machine, reply.channel}, reply.epoch, {}};
  std::memcpy(key.instance.bytes.data(), reply.instance, sizeof reply.instance);
  return key;
}

}  // namespace

/// The type of replies in which each enumeration may have any value (dds_opcodes.h). Its XTypes
/// description is that of the original type, so that writers of that type match it.
struct ForeignReplies::Type {
  Type() {
    constexpr std::uint32_t opcode_mask = 0xFF000000;
    constexpr std::uint32_t type_mask = 0x007F0000;
    constexpr std::uint32_t any_value = 0x7FFFFFFF;
    for (std::size_t i = 0; i + 2 < ops.size(); ++i) {
      // An instruction of three words: operation, offset, and the largest value.
      if ((ops[i] & opcode_mask) == DDS_OP_ADR && (ops[i] & type_mask) == DDS_OP_TYPE_ENU) {
        ops[i + 2] = any_value;
      }
    }
    descriptor.m_ops = ops.data();
  }
  Type(const Type&) = delete;
  Type& operator=(const Type&) = delete;

  /// The keys stand last, an instruction of two words each.
  std::vector<std::uint32_t> ops{
      millrace_Reply_desc.m_ops,
      millrace_Reply_desc.m_ops +
          millrace_Reply_desc.m_keys[millrace_Reply_desc.m_nkeys - 1].m_offset + 2};
  dds_topic_descriptor_t descriptor = millrace_Reply_desc;
};

ForeignReplies::ForeignReplies(const dds::Participant& participant, const std::string& partition,
                               const EndpointOptions& options)
    : type_(std::make_unique<Type>()),
      topic_(dds::check(dds_create_topic(participant.handle(), &type_->descriptor, reply_topic.name,
                                         nullptr, nullptr),
                        fmt::format("create the topic {}", reply_topic.name))),
      subscriber_(create_subscriber(participant, partition)) {
  // Before Cyclone stores a new key.
  dds::check(dds_set_topic_filter_and_arg(
                 topic_.handle(),
                 [](const void* sample, void* self) -> bool {
                   bool admitted = true;
                   base::program::contain("finding the requester of a reply", [&] {
                     const auto& reply = *static_cast<const millrace_Reply*>(sample);
                     auto& replies = *static_cast<ForeignReplies*>(self);
                     const std::lock_guard guard(replies.lock_);
                     admitted = replies.keys_.admits(key_of(reply));
                   });
                   return admitted;
                 },
                 this),
             "filter replies");
  // All: the requester of a reply is in its key, and a stranger's samples must not displace those
  // of the instance.
  reader_ =
      dds::Entity(dds::check(dds_create_reader(subscriber_.handle(), topic_.handle(),
                                               reader_qos(reply_topic, Keep::all, options).get(),
                                               reader_listener(participant, options).get()),
                             fmt::format("read {} in {}", reply_topic.name, partition)));
}

ForeignReplies::~ForeignReplies() = default;

void ForeignReplies::ask(const RequestKey& key) {
  const std::lock_guard guard(lock_);
  keys_.ask(key);
}

std::uint64_t ForeignReplies::dropped() const {
  const std::lock_guard guard(lock_);
  return keys_.dropped();
}

std::vector<Taken<Reply>> ForeignReplies::take() {
  std::vector<Taken<Reply>> taken;
  take_lent<millrace_Reply>(reader_.handle(),
                            [&](const millrace_Reply& sample, const dds_sample_info_t& info) {
                              Taken<Reply> one{Codec<Reply>::decode(sample), info.valid_data,
                                               instance_state_of(info), info.publication_handle};
                              // The numbers of later versions are larger than the known ones.
                              if (number_of(sample.kind) > millrace_declined_reply ||
                                  number_of(sample.code) > millrace_code_refused) {
                                one.value.kind = unknown_kind;
                              }
                              if (!one.valid && one.instance_state == InstanceState::disposed) {
                                // Cyclone keeps its key, and asks no filter.
                                const std::lock_guard guard(lock_);
                                keys_.admits(key_of(one.value));
                              }
                              taken.push_back(std::move(one));
                            });
  return taken;
}

}  // namespace millrace::fabric::wire
