#include "tools/caller/caller.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/endpoints/call_endpoint.hpp"
#include "tools/caller/calls.hpp"

namespace millrace::tools::caller {

namespace asio = boost::asio;

namespace {

Moment now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

}  // namespace

struct Caller::Impl : fabric::endpoints::CallEndpointListener, std::enable_shared_from_this<Impl> {
  Impl(fabric::dds::Participant& participant, const asio::any_io_executor& own_executor,
       CallerListener& own_listener, const Slot& slot)
      : executor(own_executor),
        listener(&own_listener),
        calls(slot.before_first()),
        timer(own_executor),
        end(std::make_unique<fabric::endpoints::CallEndpoint>(
            participant, own_executor, *this, fabric::endpoints::CallEndpoint::Of::tool)) {}

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    calls.on_instance_ready(instance, now());
    carry_out();
    listener->on_instances();
  }
  void on_instance_changed(const fabric::InstanceIdentity& instance) override {
    on_instance_ready(instance);
  }
  void on_load(const fabric::InstanceLoad& load) override {
    calls.on_load(load, now());
    carry_out();
  }
  void on_instance_gone(const fabric::InstanceId& instance) override {
    calls.on_instance_gone(instance, now());
    carry_out();
    listener->on_instances();
  }
  void on_reply(const fabric::Reply& reply) override {
    calls.on_reply(reply, now());
    carry_out();
  }
  void on_ignored(const std::string& reason) override { listener->on_ignored(reason); }

  /// Later, so that the caller knows the call's id before its end.
  void carry_out_later() {
    asio::post(executor, [self = weak_from_this()] {
      if (const auto impl = self.lock()) {
        impl->carry_out();
      }
    });
  }

  void carry_out() {
    if (carrying_out) {
      return;
    }
    carrying_out = true;
    for (Actions actions = calls.take_actions(); !actions.empty() && listener != nullptr;
         actions = calls.take_actions()) {
      for (const Action& action : actions) {
        std::visit([this](const auto& what) { perform(what); }, action);
      }
    }
    carrying_out = false;
    set_timer();
  }

  void perform(const Publish& publish) {
    if (const auto published = end->publish(publish.request); !published) {
      calls.on_unpublished(publish.request.call, published.error(), now());
    }
  }
  void perform(const Withdraw& withdraw) { end->withdraw(withdraw.key); }
  // A lost event costs an observer one line.
  void perform(const Notice& tell) { static_cast<void>(end->publish(tell.event)); }
  void perform(const Interim& interim) { listener->on_interim(interim.reply); }
  void perform(const Ended& ended) { listener->on_ended(ended); }

  void set_timer() {
    const auto next = calls.next_time();
    if (next == timer_at) {
      return;
    }
    timer_at = next;
    if (!next) {
      timer.cancel();
      return;
    }
    timer.expires_at(*next);
    timer.async_wait([self = weak_from_this()](const boost::system::error_code& error) {
      const auto impl = self.lock();
      if (!error && impl != nullptr && impl->listener != nullptr) {
        impl->timer_at.reset();
        impl->calls.on_time(now());
        impl->carry_out();
      }
    });
  }

  /// Withdraws pending calls without events to the listener.
  void close() {
    listener = nullptr;
    calls.leave(base::messages::caller_leaves(), now());
    for (const Action& action : calls.take_actions()) {
      if (const auto* withdraw = std::get_if<Withdraw>(&action)) {
        perform(*withdraw);
      } else if (const auto* tell = std::get_if<Notice>(&action)) {
        perform(*tell);
      }
    }
    timer.cancel();
    end.reset();
  }

  asio::any_io_executor executor;
  /// Null once the caller is closed.
  CallerListener* listener;
  Calls calls;
  bool carrying_out = false;
  asio::steady_timer timer;
  std::optional<SteadyTime> timer_at;
  std::unique_ptr<fabric::endpoints::CallEndpoint> end;
};

Caller::Caller(fabric::dds::Participant& participant, const asio::any_io_executor& executor,
               CallerListener& listener, const Slot& slot)
    : impl_(std::make_shared<Impl>(participant, executor, listener, slot)) {}

Caller::~Caller() {
  impl_->close();
}

tl::expected<fabric::CallId, std::string> Caller::call(const Order& order) {
  auto id = impl_->calls.add(order, now());
  impl_->carry_out_later();
  return id;
}

void Caller::give_up(const fabric::CallId& call, const fabric::Message& reason) {
  impl_->calls.give_up(call, reason, now());
  impl_->carry_out_later();
}

std::optional<fabric::Message> Caller::why_unserved(const std::string& uuid,
                                                    const fabric::ChannelKey& key) const {
  return impl_->calls.why_unserved(uuid, key);
}

bool Caller::is_given_out(const fabric::CallId& call) const {
  return impl_->calls.is_given_out(call);
}

std::optional<std::string> reason_taken(const fabric::plant::Plant& live,
                                        const fabric::ChannelKey& key) {
  for (const auto& [channel, status] : live.channels()) {
    if (channel.machine == key.machine) {
      return fmt::format(
          "a gateway serves machine '{}' on this fabric: a call in {} could replace one of its "
          "calls; choose a machine name that no gateway serves",
          key.machine, key.to_string());
    }
  }
  return std::nullopt;
}

}  // namespace millrace::tools::caller
