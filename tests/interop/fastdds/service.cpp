#include "service.hpp"

#include <iostream>

#include "identityPubSubTypes.h"
#include "millracePubSubTypes.h"
#include <fastdds/dds/subscriber/SampleInfo.hpp>

namespace millrace::tests::interop::fastdds {

namespace {

/// In each lease.
constexpr std::uint32_t heartbeats_per_lease = 4;

Nanoseconds now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Service::Service(Fabric& fabric, Options options, Handler handler)
    : options_(std::move(options)),
      handler_(std::move(handler)),
      scheduler_(options_.identity.id, options_.room) {
  if (!options_.certificate.empty()) {
    const std::string prefix = fabric.name() + "/@";
    fabric.write("millrace/v5/identity", dds::TypeSupport(new ParticipantIdentityPubSubType()),
                 {.partition = prefix + "name/" + options_.certificate,
                  .more_partitions = {prefix + "role/service"},
                  .best_effort = true});
  }
  const std::string of_uuid = fabric.name() + "/" + options_.identity.uuid;
  replies_ = fabric.write("millrace/v5/reply", dds::TypeSupport(new ReplyPubSubType()),
                          {.partition = of_uuid,
                           .user_data = writer_data(options_.identity.id),
                           .max_instances = options_.max_instances});
  heartbeats_ = fabric.write("millrace/v5/heartbeat", dds::TypeSupport(new HeartbeatPubSubType()),
                             {.partition = fabric.name(), .best_effort = true});
  threads_.emplace_back([this] { heartbeat(); });
  for (std::uint32_t i = 0; i < options_.room; ++i) {
    threads_.emplace_back([this] { work(); });
  }
  // Last: a caller that sees it may call.
  requests_ = fabric.read("millrace/v5/request", dds::TypeSupport(new RequestPubSubType()),
                          {.partition = of_uuid + "/" + text_of(options_.identity.id),
                           .user_data = reader_data(options_.identity),
                           .max_instances = options_.max_instances},
                          this);
}

Service::~Service() {
  requests_->set_listener(nullptr);
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void Service::leave() {
  Identity identity = options_.identity;
  identity.draining = true;
  Fabric::set_user_data(*requests_, reader_data(identity));
  std::unique_lock lock(mutex_);
  scheduler_.leave();
  changed_.wait(lock, [this] { return scheduler_.idle() && to_send_.empty() && sending_ == 0; });
  lock.unlock();
  replies_->wait_for_acknowledgments({2, 0});
}

void Service::on_data_available(dds::DataReader* reader) {
  Request request;
  dds::SampleInfo info;
  while (reader->take_next_sample(&request, &info) ==
         eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
    take(request, info);
  }
}

void Service::take(const Request& request, const dds::SampleInfo& info) {
  if (info.valid_data && request.attempt() > 0 && options_.on_request) {
    options_.on_request(request);
  }
  const std::lock_guard lock(mutex_);
  if (info.valid_data && request.attempt() == 0) {
    scheduler_.take_back(key_of(request));
    std::cout << "taken back: channel " << request.channel() << std::endl;
  } else if (info.valid_data) {
    if (auto reply = scheduler_.take(request, now())) {
      to_send_.push_back(std::move(*reply));
    }
  }
  // Without a writer: its gateway may return for the answer.
  changed_.notify_all();
}

/// Sends what is due, and runs the calls that may run.
void Service::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (!to_send_.empty()) {
      Reply reply = std::move(to_send_.front());
      to_send_.pop_front();
      ++sending_;
      lock.unlock();
      replies_->write(&reply);
      lock.lock();
      --sending_;
      changed_.notify_all();
    } else if (const auto call = scheduler_.begin(now())) {
      lock.unlock();
      const Answer answer = handler_(*call);
      lock.lock();
      if (auto reply = scheduler_.finish(*call, answer.text, answer.state, now())) {
        to_send_.push_back(std::move(*reply));
      }
      changed_.notify_all();
    } else {
      changed_.wait(lock);
    }
  }
}

void Service::heartbeat() {
  const Id process = random_id();
  const std::chrono::milliseconds period(options_.identity.lease_ms / heartbeats_per_lease);
  auto next = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    Heartbeat heartbeat;
    heartbeat.process(process);
    heartbeat.at(now());
    heartbeat.loads().push_back(scheduler_.load());
    lock.unlock();
    heartbeats_->write(&heartbeat);
    lock.lock();
    // Missed ones are not made up for.
    next = std::max(next + period, std::chrono::steady_clock::now());
    changed_.wait_until(lock, next, [this] { return stopping_; });
  }
}

}  // namespace millrace::tests::interop::fastdds
