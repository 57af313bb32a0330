#include "fabric/endpoints/request_writers.hpp"

#include <utility>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

namespace millrace::fabric::endpoints {

RequestWriters::RequestWriters(const dds::Participant& participant,
                               boost::asio::any_io_executor executor, std::weak_ptr<void> owner,
                               dds::MatchQueue& matches)
    : participant_(participant),
      executor_(std::move(executor)),
      owner_(std::move(owner)),
      matches_(matches) {}

void RequestWriters::open(const wire::RequestPartition& of) {
  if (const auto known = writers_.find(of.instance); known != writers_.end()) {
    known->second.vanished = false;
    if (known->second.uuid == of.uuid) {
      return;
    }
    std::erase(unsent_, &known->second);
    writers_.erase(known);
  }
  const dds::Listener on_match(dds_create_listener(nullptr));
  matches_.listen(on_match.get());
  writers_.try_emplace(of.instance, participant_, of,
                       wire::EndpointOptions{.listener = on_match.get(), .batched = true});
}

void RequestWriters::on_vanished(const InstanceId& instance) {
  if (const auto target = writers_.find(instance); target != writers_.end()) {
    target->second.vanished = true;
    close_if_done(target);
  }
}

void RequestWriters::close_if_done(Writers::iterator target) {
  if (target->second.vanished && target->second.pending.empty()) {
    std::erase(unsent_, &target->second);
    target->second.writer.flush();
    writers_.erase(target);
  }
}

tl::expected<void, std::string> RequestWriters::publish(const Request& request) {
  const auto target = writers_.find(request.assigned);
  if (target == writers_.end()) {
    return tl::unexpected(fmt::format("instance {} was not discovered on fabric '{}'",
                                      request.assigned.to_string(), participant_.options().fabric));
  }
  auto written = target->second.writer.write(request);
  if (written) {
    target->second.pending.insert(key_of(request));
    wrote(target->second);
  }
  return written;
}

void RequestWriters::withdraw(const RequestKey& key) {
  const auto target = writers_.find(key.instance);
  if (target == writers_.end()) {
    return;
  }
  const Request over = withdrawal_of(key);
  static_cast<void>(target->second.writer.write(over));
  target->second.writer.withdraw(over);
  target->second.pending.erase(key);
  wrote(target->second);
  close_if_done(target);
}

void RequestWriters::wrote(RequestWriter& target) {
  const bool begins = !turn_.running();
  if (turn_.on_written()) {
    target.writer.flush();
  } else if (!std::exchange(target.unsent, true)) {
    unsent_.push_back(&target);
  }
  if (begins) {
    await_round();
  }
}

void RequestWriters::await_round() {
  boost::asio::post(executor_, [this, owner = owner_] {
    const auto alive = owner.lock();
    if (!alive) {
      return;
    }
    if (turn_.on_round()) {
      flush();
    } else {
      await_round();
    }
  });
}

void RequestWriters::flush() {
  for (RequestWriter* const target : unsent_) {
    target->writer.flush();
    target->unsent = false;
  }
  unsent_.clear();
}

}  // namespace millrace::fabric::endpoints
