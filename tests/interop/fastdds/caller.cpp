#include "caller.hpp"

#include <algorithm>
#include <random>
#include <thread>

#include "millracePubSubTypes.h"
#include <fastdds/dds/subscriber/SampleInfo.hpp>

namespace millrace::tests::interop::fastdds {

namespace {

/// Longer than that of the services: they announce themselves to a group that they do not read, so
/// the caller must be the one to lose them first.
constexpr int lease_seconds = 100;

std::string text_of(const dds::UserDataQosPolicy& data) {
  const auto& bytes = data.data_vec();
  return {bytes.begin(), bytes.end()};
}

std::uint64_t random_epoch() {
  std::random_device chance;
  return (static_cast<std::uint64_t>(chance()) << 32U) | chance();
}

}  // namespace

Caller::Caller(std::uint32_t domain, const std::string& fabric, std::string uuid)
    : uuid_(std::move(uuid)),
      epoch_(random_epoch()),
      fabric_(
          {.domain = domain, .name = fabric, .lease_seconds = lease_seconds, .listener = this}) {
  replies_ = fabric_.read("millrace/v5/reply", dds::TypeSupport(new ReplyPubSubType()),
                          {.partition = fabric + "/" + uuid_}, this);
}

Caller::~Caller() {
  replies_->set_listener(nullptr);
}

void Caller::on_subscriber_discovery(dds::DomainParticipant* /*participant*/,
                                     eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) {
  using Info = eprosima::fastrtps::rtps::ReaderDiscoveryInfo;
  if (info.info.topicName() != "millrace/v5/request") {
    return;
  }
  const std::lock_guard lock(mutex_);
  const auto identity = parse_reader_data(text_of(info.info.m_qos.m_userData));
  if (info.status == Info::REMOVED_READER || !identity || identity->uuid != uuid_ ||
      identity->draining) {
    instances_.erase(info.info.guid());
  } else {
    instances_[info.info.guid()] = *identity;
  }
  changed_.notify_all();
}

void Caller::on_publisher_discovery(dds::DomainParticipant* /*participant*/,
                                    eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) {
  if (info.info.topicName() == "millrace/v5/reply") {
    const std::lock_guard lock(mutex_);
    writers_[info.info.guid()] = text_of(info.info.m_qos.m_userData);
  }
}

bool Caller::matched() const {
  dds::PublicationMatchedStatus there;
  dds::SubscriptionMatchedStatus back;
  requests_->get_publication_matched_status(there);
  replies_->get_subscription_matched_status(back);
  return there.current_count > 0 && back.current_count > 0;
}

bool Caller::await_instance(std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  std::unique_lock lock(mutex_);
  if (!changed_.wait_until(lock, end, [this] { return !instances_.empty(); })) {
    return false;
  }
  called_ = instances_.begin()->second.id;
  lock.unlock();
  // Its partition.
  requests_ =
      fabric_.write("millrace/v5/request", dds::TypeSupport(new RequestPubSubType()),
                    {.partition = fabric_.name() + "/" + uuid_ + "/" + fastdds::text_of(called_)});
  while (!matched()) {
    if (std::chrono::steady_clock::now() >= end) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

std::optional<Reply> Caller::call(std::uint16_t channel, const std::string& text,
                                  std::chrono::seconds limit) {
  Request request;
  request.machine("foreign");
  request.channel(channel);
  request.assigned(called_);
  request.epoch(epoch_);
  request.attempt(1);
  request.uuid(uuid_);
  request.text({text.begin(), text.end()});
  request.state(1);
  std::unique_lock lock(mutex_);
  request.number(++number_);
  reply_.reset();
  lock.unlock();
  requests_->write(&request);
  lock.lock();
  changed_.wait_for(lock, limit, [this] { return reply_.has_value(); });
  lock.unlock();
  // The call ends, answered or not.
  request.attempt(0);
  requests_->write(&request);
  requests_->dispose(&request, dds::HANDLE_NIL);
  return reply_;
}

void Caller::on_data_available(dds::DataReader* reader) {
  Reply reply;
  dds::SampleInfo info;
  while (reader->take_next_sample(&reply, &info) ==
         eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    const std::lock_guard lock(mutex_);
    // The identity of the writer counts, not the instance in the sample.
    const auto writer = writers_.find(info.sample_identity.writer_guid());
    if (info.valid_data && writer != writers_.end() && writer->second == writer_data(called_) &&
        reply.instance() == called_ && reply.epoch() == epoch_ && reply.number() == number_ &&
        reply.kind() == reply_kind::final) {
      reply_ = reply;
      changed_.notify_all();
    }
  }
}

}  // namespace millrace::tests::interop::fastdds
