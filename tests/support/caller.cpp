#include "tests/support/caller.hpp"

#include <map>
#include <stdexcept>

#include <boost/asio/io_context.hpp>

#include "fabric/endpoints/call_endpoint.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::tests {

struct Caller::Impl : fabric::endpoints::CallEndpointListener {
  explicit Impl(std::uint32_t domain)
      : participant({.domain = domain}), end(participant, context.get_executor(), *this) {}

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    instances.insert_or_assign(instance.id, instance);
  }
  void on_instance_changed(const fabric::InstanceIdentity& instance) override {
    instances.insert_or_assign(instance.id, instance);
  }
  void on_instance_gone(const fabric::InstanceId& instance) override { instances.erase(instance); }
  void on_reply(const fabric::Reply& reply) override {
    if (reply.kind == fabric::ReplyKind::final) {
      replies.insert_or_assign(reply.call, reply);
    }
  }

  [[nodiscard]] const fabric::InstanceIdentity* find(const std::string& uuid) const {
    for (const auto& [id, instance] : instances) {
      if (instance.uuid == fabric::canonical_uuid(uuid) && !instance.draining) {
        return &instance;
      }
    }
    return nullptr;
  }

  boost::asio::io_context context;
  std::map<fabric::InstanceId, fabric::InstanceIdentity> instances;
  std::map<fabric::CallId, fabric::Reply> replies;
  std::uint64_t next_number = 1;
  // Replies to another caller on the same fabric must not be taken for ours.
  std::uint64_t epoch =
      static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
  fabric::dds::Participant participant;
  fabric::endpoints::CallEndpoint end;
};

namespace {

void check(const tl::expected<void, std::string>& published) {
  if (!published) {
    throw std::runtime_error(published.error());
  }
}

}  // namespace

Caller::Caller(std::uint32_t domain) : impl_(std::make_unique<Impl>(domain)) {}
Caller::~Caller() = default;

bool Caller::await_instance(const std::string& uuid, std::chrono::milliseconds timeout) {
  return run_until(
      impl_->context, [&] { return impl_->find(uuid) != nullptr; }, timeout);
}

bool Caller::await_no_instance(const std::string& uuid, std::chrono::milliseconds timeout) {
  return run_until(
      impl_->context, [&] { return impl_->find(uuid) == nullptr; }, timeout);
}

fabric::InstanceIdentity Caller::identity(const std::string& uuid) const {
  const fabric::InstanceIdentity* const instance = impl_->find(uuid);
  if (instance == nullptr) {
    throw std::runtime_error("no instance serves " + uuid);
  }
  return *instance;
}

fabric::Request Caller::request(const std::string& uuid, const std::string& text,
                                std::uint16_t channel) {
  return {.key = {.machine = "cnc", .channel = channel},
          .call = {.epoch = impl_->epoch, .number = impl_->next_number++},
          .assigned = identity(uuid).id,
          .uuid = uuid,
          .text = text,
          .state = 1};
}

void Caller::publish(const fabric::Request& request) {
  check(impl_->end.publish(request));
  impl_->context.restart();
  impl_->context.poll();
}
void Caller::publish(const fabric::Event& event) {
  check(impl_->end.publish(event));
}
void Caller::publish(const fabric::ChannelStatus& status) {
  impl_->end.publish(status);
}

void Caller::withdraw(const fabric::Request& request) {
  impl_->end.withdraw(key_of(request));
  // A sample is sent at the end of the loop's turn; the test may wait for something else now and
  // not turn the loop again.
  impl_->context.restart();
  impl_->context.poll();
}

fabric::Reply Caller::await_reply(const fabric::Request& request,
                                  std::chrono::milliseconds timeout) {
  if (!run_until(
          impl_->context, [&] { return impl_->replies.contains(request.call); }, timeout)) {
    throw std::runtime_error("no reply to " + request.call.to_string());
  }
  return impl_->replies.at(request.call);
}

bool Caller::poll_reply(const fabric::Request& request, fabric::Reply& reply) {
  attend();
  const auto found = impl_->replies.find(request.call);
  if (found == impl_->replies.end()) {
    return false;
  }
  reply = found->second;
  return true;
}

void Caller::attend() {
  impl_->context.restart();
  impl_->context.poll();
}

void Caller::forget_reply(const fabric::Request& request) {
  impl_->replies.erase(request.call);
}

fabric::Reply Caller::call(const std::string& uuid, const std::string& text,
                           std::uint16_t channel) {
  const fabric::Request request = this->request(uuid, text, channel);
  publish(request);
  fabric::Reply reply = await_reply(request);
  withdraw(request);
  return reply;
}

}  // namespace millrace::tests
