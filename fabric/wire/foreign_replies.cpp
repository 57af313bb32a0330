#include "fabric/wire/foreign_replies.hpp"

#include <cstring>

#include "base/program/barrier.hpp"
#include "fabric/messages.hpp"
#include "idl/millrace.h"

namespace millrace::fabric::wire {

namespace {

RequestKey key_of(const millrace_Reply& reply) {
  RequestKey key{{reply.machine, reply.channel}, reply.epoch, {}};
  std::memcpy(key.instance.bytes.data(), reply.instance, sizeof reply.instance);
  return key;
}

}  // namespace

ForeignReplies::ForeignReplies(const dds::Participant& participant, const std::string& partition,
                               const EndpointOptions& options)
    : topic_(dds::check(dds_create_topic(participant.handle(), reply_topic.type, reply_topic.name,
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
  take_lent<millrace_Reply>(
      reader_.handle(), [&](const millrace_Reply& sample, const dds_sample_info_t& info) {
        Taken<Reply> received{Codec<Reply>::decode(sample), info.valid_data,
                              instance_state_of(info), info.publication_handle};
        if (!received.valid && received.instance_state == InstanceState::disposed) {
          // Cyclone keeps its key, and asks no filter.
          const std::lock_guard guard(lock_);
          keys_.admits(key_of(received.value));
        }
        taken.push_back(std::move(received));
      });
  return taken;
}

}  // namespace millrace::fabric::wire
