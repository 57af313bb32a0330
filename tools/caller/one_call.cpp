#include "tools/caller/one_call.hpp"

#include "fabric/words.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::caller {

namespace {

using Clock = bus::ListeningTime::Clock;

/// How long it waits for a service.
constexpr bus::Patience grace{.at_least = std::chrono::milliseconds(1000)};

}  // namespace

OneCall::OneCall(fabric::dds::Participant& participant, const Slot& slot, const Order& order)
    : order_(order),
      grace_(io_),
      time_(grace, Clock::now()),
      participant_(participant),
      caller_(participant, io_.get_executor(), *this, slot) {}

Ended OneCall::run() {
  const auto call = caller_.call(order_);
  if (!call) {
    return {.reason = call.error()};
  }
  call_ = *call;
  wait_for_a_service();
  io_.run();
  return ended_;
}

void OneCall::on_ended(const Ended& ended) {
  ended_ = ended;
  io_.stop();
}

void OneCall::wait_for_a_service() {
  const auto due = Clock::now() + bus::ListeningTime::look_again;
  grace_.expires_at(due);
  grace_.async_wait([this, due](const boost::system::error_code& error) {
    // A call whose instance is lost waits for the next one.
    if (error || caller_.is_given_out(call_)) {
      return;
    }
    const auto now = Clock::now();
    time_.on_timer(due, now);
    if (!bus::is_over(time_, now, participant_)) {
      wait_for_a_service();
      return;
    }
    if (const auto why = caller_.why_unserved(order_.uuid, order_.as.value_or(order_.key))) {
      give_up(*why);
    }
  });
}

boost::json::object json_of(const Order& order, const Ended& ended) {
  boost::json::object out{{"uuid", print::utf8(fabric::canonical_uuid(order.uuid))},
                          {"answered", ended.reply.has_value()},
                          {"call", ended.call.to_string()},
                          {"machine", order.key.machine},
                          {"channel", order.key.channel}};
  if (ended.reply) {
    out["response"] = print::text_json(ended.reply->text);
    out["response_state"] = ended.reply->state;
    out["code"] = fabric::name_of(ended.reply->code);
    out["instance"] = ended.reply->instance.to_string();
    out["after_ms"] = std::chrono::duration<double, std::milli>(ended.took).count();
  } else {
    print::put_message(out, "reason", ended.reason);
  }
  return out;
}

}  // namespace millrace::tools::caller
