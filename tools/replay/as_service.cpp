#include "tools/replay/as_service.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <boost/asio/post.hpp>
#include <unistd.h>

namespace millrace::tools::replay {

InstanceHeartbeats::InstanceHeartbeats(const fabric::dds::Participant& participant,
                                       const boost::asio::any_io_executor& executor, Loads loads)
    : period_(std::chrono::nanoseconds(participant.options().lease) /
              fabric::endpoints::HeartbeatEndpoint::heartbeats_per_lease),
      loads_(std::move(loads)),
      end_(participant, process_),
      timer_(executor, std::chrono::steady_clock::now()) {
  heartbeat();
}

void InstanceHeartbeats::heartbeat() {
  for (const fabric::InstanceLoad& load : loads_()) {
    heartbeats_.note(load);
  }
  // Losing one heartbeat is harmless.
  static_cast<void>(end_.publish(heartbeats_.next(std::chrono::system_clock::now())));
  // Missed heartbeats are not sent later.
  timer_.expires_at(std::max(timer_.expiry() + period_, std::chrono::steady_clock::now()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      heartbeat();
    }
  });
}

namespace asio = boost::asio;

namespace {

/// How long gateways may take to fetch the last responses.
constexpr auto drain_time = std::chrono::seconds(2);

}  // namespace

AsService::AsService(fabric::dds::Participant& participant, asio::any_io_executor executor,
                     const Plan& plan, AsServiceOptions options, AsServiceListener& listener)
    : executor_(std::move(executor)),
      plan_(plan),
      options_(std::move(options)),
      listener_(listener),
      matcher_(plan, options_.channels, options_.rounds),
      end_timer_(executor_) {
  open(participant);
  commands_.emplace(participant, executor_, *this);
  heartbeats_.emplace(participant, executor_, [this] { return loads(); });
}

void AsService::open(fabric::dds::Participant& participant) {
  std::map<std::string, std::set<fabric::ChannelKey>> channels;
  // A response of state 0 ended its call only because the program waits for the text.
  std::set<std::string> waits_for_response;
  for (const PlannedCall& call : plan_.calls) {
    const std::string uuid = fabric::canonical_uuid(call.uuid);
    channels[uuid].insert(options_.channels.at(call.channel));
    if (call.answer && call.answer->answer.state == 0) {
      waits_for_response.insert(uuid);
    }
  }
  for (const auto& [uuid, keys] : channels) {
    fabric::InstanceIdentity identity{
        .id = fabric::InstanceId::random(),
        .uuid = uuid,
        .name = options_.name,
        .description = options_.description,
        .version = options_.version,
        .host = options_.host,
        .pid = static_cast<std::uint32_t>(::getpid()),
        .completion_signal = waits_for_response.contains(uuid)
                                 ? fabric::CompletionSignal::response
                                 : fabric::CompletionSignal::response_state,
        .concurrency = static_cast<std::uint32_t>(keys.size()),
        .lease = participant.options().lease};
    for (const fabric::ChannelKey& key : keys) {
      identity.channels.push_back({key.machine, key.channel});
    }
    const fabric::InstanceId id = identity.id;
    statuses_[id] = {.instance = id, .started = std::chrono::system_clock::now()};
    ends_.emplace(id, std::make_unique<fabric::endpoints::ReplyEndpoint>(
                          participant, executor_, std::move(identity), *this));
  }
}

std::vector<fabric::InstanceIdentity> AsService::instances() const {
  std::vector<fabric::InstanceIdentity> instances;
  instances.reserve(ends_.size());
  for (const auto& [id, end] : ends_) {
    instances.push_back(end->identity());
  }
  return instances;
}

void AsService::on_request(const fabric::Request& request) {
  if (end_of(request.assigned) == nullptr) {
    return;
  }
  statuses_[request.assigned].last_call = std::chrono::system_clock::now();
  const Match match = matcher_.on_request(request);
  if (const auto* matched = std::get_if<Matched>(&match)) {
    if (matched->repeated) {
      repeat(request);
    } else {
      begin(request, *matched);
    }
    return;
  }
  const Mismatch& mismatch = std::get<Mismatch>(match);
  if (mismatch.repeated) {
    repeat(request);
  } else {
    refuse(request, mismatch);
  }
}

void AsService::begin(const fabric::Request& request, const Matched& matched) {
  const PlannedCall& call = plan_.calls[matched.call];
  if (call.answer && call.answer->answer.withheld) {
    refuse(request, {.reason = "the text of the answer is not in the recording (--without-text)",
                     .text = "ERROR: replay: the text of the answer is not in the recording"});
    return;
  }
  Pending& pending = pending_[key_of(request)] =
      Pending{.request = request,
              .received = std::chrono::system_clock::now(),
              .since = std::chrono::steady_clock::now()};
  for (const TimedAnswer& interim : call.interim) {
    fabric::Reply reply = reply_to(request, interim.answer.text, interim.answer.state);
    reply.kind = fabric::ReplyKind::interim;
    pending.script.emplace_back(delay_of(interim), std::move(reply));
  }
  // A call without a response in the recording gets none here.
  if (call.answer) {
    const Answer& answer = call.answer->answer;
    pending.script.emplace_back(delay_of(*call.answer),
                                reply_to(request, answer.text, answer.state));
  }
  listener_.on_match(request, matched.call);
  reply_next(key_of(request));
}

void AsService::refuse(const fabric::Request& request, const Mismatch& mismatch) {
  Pending& pending = pending_[key_of(request)] =
      Pending{.request = request,
              .received = std::chrono::system_clock::now(),
              .since = std::chrono::steady_clock::now()};
  fabric::Reply reply = reply_to(request, mismatch.text, options_.error_state);
  reply.code = fabric::ServiceCode::failed;
  pending.script.emplace_back(nanoseconds{}, std::move(reply));
  listener_.on_mismatch(request, mismatch.reason);
  reply_next(key_of(request));
}

void AsService::repeat(const fabric::Request& request) {
  const auto found = pending_.find(key_of(request));
  if (found == pending_.end()) {
    return;
  }
  Pending& pending = found->second;
  pending.request = request;
  if (pending.sent > 0 && pending.sent == pending.script.size()) {
    pending.script.back().second.code = fabric::ServiceCode::repeated;
    ++statuses_[request.assigned].repeated;
    --pending.sent;
    publish(pending);
  }
}

void AsService::reply_next(const fabric::RequestKey& key) {
  Pending& pending = pending_.at(key);
  if (pending.sent == pending.script.size()) {
    const fabric::InstanceId instance = pending.request.assigned;
    find_end();
    leave_if_done(instance);
    return;
  }
  const auto at = pending.since + pending.script[pending.sent].first;
  if (at <= std::chrono::steady_clock::now()) {
    publish(pending);
    reply_next(key);
    return;
  }
  pending.timer = std::make_unique<asio::steady_timer>(executor_, at);
  pending.timer->async_wait(
      [this, key, timer = pending.timer.get()](const boost::system::error_code& error) {
        // The timer may have expired before the call was withdrawn or repeated.
        const auto found = pending_.find(key);
        if (!error && found != pending_.end() && found->second.timer.get() == timer) {
          publish(found->second);
          reply_next(key);
        }
      });
}

void AsService::publish(Pending& pending) {
  fabric::Reply reply = pending.script[pending.sent++].second;
  reply.attempt = pending.request.attempt;
  reply.replayed = true;
  reply.received = pending.received;
  reply.started = pending.received;
  reply.answered = std::chrono::system_clock::now();
  if (reply.kind == fabric::ReplyKind::final && !std::exchange(pending.answered, true)) {
    fabric::InstanceStatus& status = statuses_[reply.instance];
    ++status.answered;
    status.failed += reply.code == fabric::ServiceCode::failed ? 1U : 0U;
  }
  if (const auto published = end_of(reply.instance)->publish(reply); !published) {
    listener_.on_mismatch(pending.request, published.error());
  }
}

void AsService::on_withdrawn(const fabric::RequestKey& key) {
  const auto found = pending_.find(key);
  if (found == pending_.end()) {
    return;
  }
  const fabric::InstanceId instance = found->second.request.assigned;
  statuses_[instance].cancelled += found->second.answered ? 0U : 1U;
  pending_.erase(found);
  find_end();
  leave_if_done(instance);
}

void AsService::find_end() {
  if (!matcher_.complete()) {
    return;
  }
  if (pending_.empty() && !complete_) {
    complete_ = true;
    end_timer_.cancel();
    listener_.on_complete();
  } else if (!complete_ && std::ranges::all_of(pending_, [](const auto& pending) {
               return pending.second.sent == pending.second.script.size();
             })) {
    end_timer_.expires_after(drain_time);
    end_timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error && !complete_) {
        complete_ = true;
        listener_.on_complete();
      }
    });
  }
}

std::optional<std::uint32_t> AsService::running(const fabric::InstanceId& instance) const {
  if (!ends_.contains(instance)) {
    return std::nullopt;
  }
  return static_cast<std::uint32_t>(std::ranges::count_if(pending_, [&](const auto& pending) {
    return pending.second.request.assigned == instance &&
           pending.second.sent < pending.second.script.size();
  }));
}

std::vector<fabric::InstanceLoad> AsService::loads() const {
  std::map<fabric::InstanceId, fabric::InstanceLoad> loads;
  for (const auto& [id, end] : ends_) {
    loads[id].status = statuses_.at(id);
  }
  for (const auto& [key, pending] : pending_) {
    const auto load = loads.find(pending.request.assigned);
    if (!pending.answered && load != loads.end()) {
      load->second.calls.push_back(pending.request.call);
      ++load->second.status.running;
    }
  }
  std::vector<fabric::InstanceLoad> all;
  all.reserve(loads.size());
  for (auto& [id, load] : loads) {
    all.push_back(std::move(load));
  }
  return all;
}

void AsService::on_drain(const fabric::InstanceId& instance, const std::string& issuer) {
  fabric::endpoints::ReplyEndpoint& end = *ends_.at(instance);
  end.set_draining(true);
  listener_.on_drain(end.identity(), issuer);
  const auto [timer, is_new] = draining_.try_emplace(instance, executor_);
  if (is_new) {
    timer->second.expires_after(fabric::endpoints::InstanceCommands::drain_grace);
    timer->second.async_wait([this, instance](const boost::system::error_code& error) {
      if (!error) {
        leave_if_done(instance);
      }
    });
  }
}

void AsService::on_unreported(const fabric::Command& /*command*/, const std::string& /*reason*/) {
  // The operator repeats the command when no outcome arrives.
}

void AsService::leave_if_done(const fabric::InstanceId& instance) {
  const auto timer = draining_.find(instance);
  if (timer == draining_.end() || timer->second.expiry() > std::chrono::steady_clock::now() ||
      running(instance) != 0U) {
    return;
  }
  // Posted: an instance must not end inside its own callback.
  asio::post(executor_, [this, instance] {
    std::erase_if(pending_,
                  [&](const auto& pending) { return pending.second.request.assigned == instance; });
    ends_.erase(instance);
    heartbeats_->forget(instance);
    draining_.erase(instance);
    if (ends_.empty() && !complete_) {
      complete_ = true;
      listener_.on_complete();
    }
  });
}

nanoseconds AsService::delay_of(const TimedAnswer& answer) const {
  if (options_.pace.timing == Timing::fast) {
    return {};
  }
  return options_.pace.scaled(answer.work != nanoseconds{} ? answer.work : answer.after);
}

fabric::endpoints::ReplyEndpoint* AsService::end_of(const fabric::InstanceId& instance) {
  const auto found = ends_.find(instance);
  return found == ends_.end() ? nullptr : found->second.get();
}

}  // namespace millrace::tools::replay
