#include "services/c/requests.hpp"

#include <limits>

#include <boost/asio/io_context.hpp>

#include "base/messages/catalogue.hpp"
#include "services/c/participant.hpp"
#include "tools/caller/caller.hpp"

namespace millrace::services::c {

namespace {

using Clock = tools::bus::ListeningTime::Clock;

/// How long a request waits until an instance of its service is discovered.
constexpr tools::bus::Patience grace{.at_least = std::chrono::milliseconds(1000)};

std::int32_t result_of(fabric::ServiceCode code) {
  switch (code) {
    case fabric::ServiceCode::ok:
      return MILLRACE_RESULT_OK;
    case fabric::ServiceCode::failed:
      return MILLRACE_RESULT_FAILED;
    case fabric::ServiceCode::repeated:
      return MILLRACE_RESULT_REPEATED;
    case fabric::ServiceCode::refused:
      return MILLRACE_RESULT_REFUSED;
  }
  return MILLRACE_RESULT_FAILED;
}

}  // namespace

void Progress::add_interim(const fabric::Reply& reply) {
  const std::lock_guard guard(lock_);
  interim_.push_back(reply);
  news_.notify_all();
}

void Progress::end(Result result) {
  const std::lock_guard guard(lock_);
  final_ = std::move(result);
  news_.notify_all();
}

bool Progress::has_ended() const {
  const std::lock_guard guard(lock_);
  return final_.has_value();
}

Progress::Result Progress::wait(std::optional<std::chrono::milliseconds> limit) {
  std::unique_lock guard(lock_);
  const auto something = [this] { return !interim_.empty() || final_; };
  if (!limit) {
    news_.wait(guard, something);
  } else {
    news_.wait_for(guard, *limit, something);
  }
  if (!interim_.empty()) {
    Result result{.code = MILLRACE_INTERIM, .reply = std::move(interim_.front())};
    interim_.pop_front();
    return result;
  }
  return final_ ? *final_ : Result{};
}

Requests::Requests(sdk::SharedParticipant& shared)
    : shared_(shared),
      slot_("call", shared.participant().options()),
      caller_(shared.participant(), shared.loop().get_executor(), *this, slot_) {}

Requests::~Requests() {
  for (auto& [call, pending] : pending_) {
    pending.progress->end({.code = MILLRACE_CLOSED, .reason = "the participant leaves its fabric"});
  }
}

/// The lowest one: services accept a limited number of DDS instances from a participant.
std::uint16_t Requests::free_channel() const {
  if (used_.size() >= std::numeric_limits<std::uint16_t>::max()) {
    throw Error(MILLRACE_FAILED, "65,535 requests are under way");
  }
  std::uint16_t channel = 1;
  for (auto used = used_.begin(); used != used_.end() && *used == channel; ++used) {
    ++channel;
  }
  return channel;
}

fabric::CallId Requests::send(tools::caller::Order order,
                              const std::shared_ptr<Progress>& progress) {
  order.key = {slot_.machine(), free_channel()};
  const auto call = caller_.call(order);
  if (!call) {
    throw Error(MILLRACE_INVALID, call.error());
  }
  used_.insert(order.key.channel);
  pending_.insert_or_assign(
      *call, Pending{.progress = progress,
                     .order = std::move(order),
                     .time = {grace, Clock::now()},
                     .timer = std::make_unique<boost::asio::steady_timer>(shared_.loop())});
  wait_for_an_instance(*call);
  return *call;
}

void Requests::cancel(const fabric::CallId& call) {
  if (pending_.contains(call)) {
    caller_.give_up(call, base::messages::cancelled_by_caller());
  }
}

void Requests::wait_for_an_instance(const fabric::CallId& call) {
  const auto due = Clock::now() + tools::bus::ListeningTime::look_again;
  boost::asio::steady_timer& timer = *pending_.at(call).timer;
  timer.expires_at(due);
  timer.async_wait([this, call, due](const boost::system::error_code& error) {
    const auto found = error ? pending_.end() : pending_.find(call);
    if (error || found == pending_.end() || caller_.is_given_out(call)) {
      return;
    }
    Pending& pending = found->second;
    const auto now = Clock::now();
    pending.time.on_timer(due, now);
    if (!tools::bus::is_over(pending.time, now, shared_.participant())) {
      wait_for_an_instance(call);
      return;
    }
    const auto why =
        caller_.why_unserved(pending.order.uuid, pending.order.as.value_or(pending.order.key));
    if (why) {
      pending.unserved = true;
      caller_.give_up(call, *why);
    }
  });
}

void Requests::on_ended(const tools::caller::Ended& ended) {
  const auto found = pending_.find(ended.call);
  if (found == pending_.end()) {
    return;
  }
  const Pending pending = std::move(found->second);
  pending_.erase(found);
  used_.erase(ended.key.channel);
  if (ended.reply) {
    pending.progress->end({.code = MILLRACE_OK, .reply = *ended.reply, .took = ended.took});
  } else {
    pending.progress->end({.code = pending.unserved ? MILLRACE_UNSERVED : MILLRACE_NO_RESPONSE,
                           .reason = ended.reason});
  }
}

void Requests::on_interim(const fabric::Reply& reply) {
  if (const auto found = pending_.find(reply.call); found != pending_.end()) {
    found->second.progress->add_interim(reply);
  }
}

}  // namespace millrace::services::c

namespace c = millrace::services::c;

struct millrace_request {
  std::shared_ptr<c::Participant> participant;
  std::shared_ptr<c::Progress> progress;
  millrace::fabric::CallId call{};
  // The last response, with the texts that it points to.
  c::Progress::Result result{};
  std::string instance{};
  std::string call_id{};
  millrace_response response{};
};

millrace_code millrace_request_send(millrace_participant* participant,
                                    const millrace_request_options* options,
                                    millrace_request** request) {
  return c::guarded([&] {
    c::checked(request, "request") = nullptr;
    auto state = c::state_of(participant);
    const millrace_request_options given = c::read_options(
        c::checked(options, "millrace_request_options"), "millrace_request_options");
    state->check_discovers("millrace_request_send");
    if (given.uuid == nullptr) {
      throw c::Error(MILLRACE_INVALID, "millrace_request_options: uuid is NULL");
    }
    millrace::tools::caller::Order order{
        .uuid = given.uuid,
        .text = std::string(c::text_of(given.text, given.text_length, "text")),
        .state = given.state == 0 ? 1 : given.state,
        .patience = std::chrono::milliseconds(given.timeout_ms == 0 ? 10'000 : given.timeout_ms)};
    if (given.machine != nullptr) {
      order.as = {given.machine, given.channel == 0 ? std::uint16_t{1} : given.channel};
    }
    auto handle = std::make_unique<millrace_request>(
        millrace_request{.participant = state, .progress = std::make_shared<c::Progress>()});
    c::Requests& requests = state->requests();
    handle->call = state->on_loop([&] { return requests.send(order, handle->progress); });
    handle->call_id = handle->call.to_string();
    *request = handle.release();
  });
}

millrace_code millrace_request_wait(millrace_request* request, uint32_t timeout_ms,
                                    const millrace_response** response) {
  return c::guarded([&]() -> millrace_code {
    c::checked(response, "response") = nullptr;
    c::check_process(c::checked(request, "request").participant->process());
    request->result = request->progress->wait(
        timeout_ms == MILLRACE_FOREVER ? std::nullopt
                                       : std::optional(std::chrono::milliseconds(timeout_ms)));
    const c::Progress::Result& result = request->result;
    if (result.code == MILLRACE_NOTHING) {
      return MILLRACE_NOTHING;
    }
    if (result.code != MILLRACE_OK && result.code != MILLRACE_INTERIM) {
      throw c::Error(result.code, result.reason);
    }
    request->instance = result.reply.instance.to_string();
    request->response = {.size = sizeof request->response,
                         .text = result.reply.text.c_str(),
                         .text_length = result.reply.text.size(),
                         .state = result.reply.state,
                         .result = c::result_of(result.reply.code),
                         .instance = request->instance.c_str(),
                         .call_id = request->call_id.c_str(),
                         .duration_ns = result.took.count()};
    *response = &request->response;
    return result.code;
  });
}

void millrace_request_free(millrace_request* request) {
  if (request == nullptr || request->participant->process() != ::getpid()) {
    return;
  }
  if (!request->progress->has_ended()) {
    static_cast<void>(c::guarded([request] {
      c::Requests& requests = request->participant->requests();
      request->participant->on_loop([&] { requests.cancel(request->call); });
      return MILLRACE_OK;
    }));
  }
  delete request;
}
