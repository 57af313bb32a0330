#include "services/http/host.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/messages/catalogue.hpp"
#include "fabric/alarm.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "services/sdk/host_program.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::http {

namespace {

using std::chrono::milliseconds;

/// Between two checks of an endpoint that is not reachable, at most.
constexpr milliseconds retry_period{1000};
/// Between two announcements of an endpoint whose checks succeed and whose calls do not begin, at
/// most, and how long it must go on without such a call (both our choice).
constexpr milliseconds longest_pause{5000};
constexpr milliseconds probation{10000};
/// Of one check.
constexpr milliseconds check_limit{5000};
/// Between two looks for changed files, and at a result that could not be read.
constexpr milliseconds look_period{250};
constexpr const char* alarm_kind = "endpoint";

/// The URL, if it is short enough to be a subject.
std::string alarm_subject(const Endpoint& endpoint) {
  constexpr std::size_t most = 63;
  constexpr std::size_t most_before_hash = 46;
  return endpoint.url.size() <= most
             ? endpoint.url
             : fmt::format("{}{:016x}", fabric::shortened(endpoint.url, most_before_hash),
                           std::hash<std::string>{}(endpoint.url));
}

milliseconds left_until(std::chrono::steady_clock::time_point end,
                        std::chrono::steady_clock::time_point now) {
  return std::max(milliseconds(1), std::chrono::ceil<milliseconds>(end - now));
}

/// The time limit of the endpoint, or the deadline of the call, if that is earlier.
milliseconds limit_of(const Endpoint& endpoint, const fabric::Request& call, fabric::Time now) {
  if (call.deadline == fabric::Time{}) {
    return endpoint.time_limit;
  }
  return std::clamp(std::chrono::ceil<milliseconds>(call.deadline - now), milliseconds(1),
                    endpoint.time_limit);
}

}  // namespace

Host::Host(const std::filesystem::path& file, const std::vector<Endpoint>& endpoints,
           sdk::ServiceOptions base, const std::string& name, sdk::Service::Log log)
    : file_(file),
      base_(std::move(base)),
      log_(std::move(log)),
      files_(files_of(file, endpoints)),
      settle_(settle, sdk::fingerprint(files_), Clock::now()) {
  alarms_.join(base_.participant, sdk::identity_of_process(name), log_);
  serve(endpoints);
}

void Host::run() {
  while (!done()) {
    transfers_.run(until_next(Clock::now()));
    read_inbox();
    on_time(Clock::now());
  }
  alarms_.leave();
}

void Host::stop() {
  const std::lock_guard guard(lock_);
  stop_ = true;
  transfers_.wake();
}

bool Host::done() const {
  const bool all_dismissed =
      !served_.empty() &&
      std::ranges::all_of(served_, [](const Served& served) { return served.dismissed; });
  return announced_.empty() && (stopping_ || all_dismissed);
}

/// Adds what is new, and removes what is missing or different after its calls.
void Host::serve(const std::vector<Endpoint>& endpoints) {
  std::erase_if(served_, [&](Served& served) {
    if (std::ranges::find(endpoints, *served.endpoint) != endpoints.end()) {
      return false;
    }
    drain(served);
    if (served.check) {
      transfers_.cancel(*served.check);
    }
    alarms_.clear(alarm_kind, alarm_subject(*served.endpoint));
    log_->info("{} has stopped serving {} with {}", served.endpoint->announcement.name,
               served.endpoint->announcement.uuid, served.endpoint->url);
    return true;
  });
  for (const Endpoint& endpoint : endpoints) {
    if (std::ranges::none_of(served_,
                             [&](const Served& served) { return *served.endpoint == endpoint; })) {
      served_.push_back({.endpoint = std::make_shared<const Endpoint>(endpoint)});
    }
  }
}

void Host::reload_if_changed(Time now) {
  if (now < next_look_) {
    return;
  }
  next_look_ = now + look_period;
  if (!settle_.look(sdk::fingerprint(files_), now)) {
    return;
  }
  const auto endpoints = load(file_).and_then(with_secrets);
  if (!endpoints) {
    log_->error("{}\nThe services are not changed.", endpoints.error());
    return;
  }
  files_ = files_of(file_, *endpoints);
  settle_ = sdk::Settle(settle, sdk::fingerprint(files_), now);
  serve(*endpoints);
}

void Host::check(Served& served, Time now) {
  const Endpoint& endpoint = *served.endpoint;
  served.next_check = now + endpoint.health_period;
  served.check =
      transfers_.start({.endpoint = served.endpoint,
                        .url = endpoint.health_url.empty() ? endpoint.url : endpoint.health_url,
                        .connect_only = endpoint.health_url.empty(),
                        .limit = check_limit},
                       [this, &served](const Exchange& exchange) { checked(served, exchange); });
}

void Host::checked(Served& served, const Exchange& exchange) {
  constexpr int success = 2;
  constexpr int hundred = 100;
  served.check.reset();
  const Endpoint& endpoint = *served.endpoint;
  if (exchange.end != Exchange::End::responded && exchange.end != Exchange::End::too_long) {
    served.not_begun = 0;
    take_down(served,
              fmt::format("the endpoint {} does not answer: {}", endpoint.url, exchange.reason));
  } else if (!endpoint.health_url.empty() && exchange.status / hundred != success) {
    served.not_begun = 0;
    take_down(served, fmt::format("the endpoint {} does not serve: {} returns HTTP {}",
                                  endpoint.url, endpoint.health_url, exchange.status));
  } else if (!served.announced && !served.dismissed && !stopping_) {
    announce(served);
  }
}

void Host::announce(Served& served) {
  const Endpoint& endpoint = *served.endpoint;
  const Number number = ++last_number_;
  Announced& announced = announced_[number];
  announced.endpoint = served.endpoint;
  try {
    announced.instance = std::make_unique<sdk::Instance>(
        sdk::options_of(endpoint.announcement, base_), log_,
        sdk::InstanceCallbacks{
            .call = [this, number](const CallPointer& call) { put(number, call); },
            .cancelled = [this, number](fabric::CallId call) { put(number, Cancelled{call}); },
            .draining =
                [this, number](const std::string& issuer) {
                  if (!issuer.empty()) {
                    put(number, Dismissed{});
                  }
                }});
    served.announced = number;
    if (served.not_begun == 0) {
      recover(served);
    } else {
      served.recovered_at = Clock::now() + probation;
    }
    log_->info("{} serves {} with {}", endpoint.announcement.name, endpoint.announcement.uuid,
               endpoint.url);
  } catch (const std::exception& error) {
    announced_.erase(number);
    take_down(served, fmt::format("{} cannot serve {}: {}", endpoint.announcement.name,
                                  endpoint.announcement.uuid, error.what()));
  }
}

void Host::take_down(Served& served, const std::string& reason) {
  const Endpoint& endpoint = *served.endpoint;
  alarms_.raise({.key = {.kind = alarm_kind, .subject = alarm_subject(endpoint)},
                 .level = fabric::AlarmLevel::problem,
                 .text = base::messages::endpoint_down(reason, endpoint.announcement.uuid),
                 .advice = base::messages::check_endpoint()});
  if (served.trouble != reason) {
    served.trouble = reason;
    log_->warn("{}; {} is not served with it", reason, endpoint.announcement.uuid);
  }
  drain(served);
  served.recovered_at = Time::max();
  const milliseconds pause = std::min(endpoint.health_period, retry_period);
  served.next_check =
      served.not_begun == 0
          ? std::min(served.next_check, Clock::now() + pause)
          : Clock::now() + std::min(pause * (1U << served.not_begun), longest_pause);
}

/// A check proves a connection; that a call begins is proved by a response.
void Host::recover(Served& served) {
  served.trouble.clear();
  served.not_begun = 0;
  served.recovered_at = Time::max();
  alarms_.clear(alarm_kind, alarm_subject(*served.endpoint));
}

void Host::drain(Served& served) {
  if (!served.announced) {
    return;
  }
  Announced& announced = announced_.at(*served.announced);
  served.announced.reset();
  announced.instance->drain();
  announced.leaves_at = Clock::now() + fabric::endpoints::InstanceCommands::drain_grace;
}

Host::Served* Host::served_of(Number number) {
  const auto found = std::ranges::find_if(
      served_, [&](const Served& served) { return served.announced == number; });
  return found == served_.end() ? nullptr : &*found;
}

void Host::put(Number to, std::variant<CallPointer, Cancelled, Dismissed> content) {
  const std::lock_guard guard(lock_);
  inbox_.push_back({to, std::move(content)});
  transfers_.wake();
}

void Host::read_inbox() {
  std::unique_lock guard(lock_);
  const std::vector<Message> messages = std::exchange(inbox_, {});
  const bool stop = stop_;
  guard.unlock();
  for (const Message& message : messages) {
    if (const auto* call = std::get_if<CallPointer>(&message.content)) {
      begin(message.to, *call);
    } else if (const auto* cancelled = std::get_if<Cancelled>(&message.content)) {
      if (RunningCall* const running = find(message.to, cancelled->call)) {
        if (running->transfer) {
          transfers_.cancel(*running->transfer);
        }
        end(announced_.at(message.to), cancelled->call,
            text::error(state_withdrawn, "the call was cancelled"));
      }
    } else if (Served* const served = served_of(message.to)) {
      served->dismissed = true;
      drain(*served);
    }
  }
  if (stop && !std::exchange(stopping_, true)) {
    for (Served& served : served_) {
      drain(served);
    }
  }
}

void Host::begin(Number number, const CallPointer& call) {
  const auto place = announced_.find(number);
  if (place == announced_.end()) {
    return;
  }
  Announced& at = place->second;
  const EndpointPointer endpoint = at.endpoint;
  const Time now = Clock::now();
  if (call->cancelled()) {
    call->answer(text::error(state_withdrawn, "the call was cancelled"));
    return;
  }
  const bool full = now < at.full_until;
  if (!full) {
    at.declined.clear();
  } else if (!call->request().may_wait && at.declined.insert(call->id()).second) {
    call->decline(fmt::format("{} has no room", endpoint->url));
    return;
  }
  RunningCall& running = at.calls[call->id()];
  running = {.call = call, .end = Time::max()};
  if (full) {
    running.next = at.full_until;
  } else {
    post(number, running, now);
  }
}

void Host::post(Number number, RunningCall& running, Time now) {
  const EndpointPointer endpoint = announced_.at(number).endpoint;
  const fabric::Request& request = running.call->request();
  const fabric::Time wall = std::chrono::system_clock::now();
  const milliseconds limit = limit_of(*endpoint, request, wall);
  running.next.reset();
  running.end = now + limit;
  running.transfer = transfers_.start(
      {.endpoint = endpoint,
       .url = endpoint->url,
       .post = post_for(*endpoint, request, limit, wall),
       .limit = limit},
      [this, number, id = request.call](const Exchange& exchange) { ended(number, id, exchange); });
}

Host::RunningCall* Host::find(Number number, fabric::CallId id) {
  const auto place = announced_.find(number);
  if (place == announced_.end()) {
    return nullptr;
  }
  const auto call = place->second.calls.find(id);
  return call == place->second.calls.end() ? nullptr : &call->second;
}

void Host::ended(Number number, fabric::CallId id, const Exchange& exchange) {
  RunningCall* const running = find(number, id);
  if (running == nullptr) {
    return;
  }
  Announced& at = announced_.at(number);
  running->transfer.reset();
  const bool is_result = !running->result_url.empty();
  const Verdict verdict = judge(*at.endpoint, exchange);
  Served* const served = served_of(number);
  const bool has_answered =
      !std::holds_alternative<NotBegun>(verdict) && !std::holds_alternative<Lost>(verdict);
  if (served != nullptr && served->not_begun > 0 && has_answered) {
    recover(*served);
  }
  if (const auto* answer = std::get_if<Answer>(&verdict)) {
    end(at, id, answer->response);
  } else if (const auto* accepted = std::get_if<Accepted>(&verdict)) {
    if (accepted->interim) {
      running->call->interim(*accepted->interim);
    }
    running->result_url = accepted->url;
    running->next = Clock::now() + accepted->pause;
  } else if (is_result) {
    // The call runs, and a look at its result can be repeated.
    const auto* full = std::get_if<NoRoom>(&verdict);
    running->next = Clock::now() + (full == nullptr ? look_period : milliseconds(full->pause));
  } else if (const auto* full = std::get_if<NoRoom>(&verdict)) {
    at.full_until = Clock::now() + full->pause;
    at.declined.insert(id);
    running->call->decline(fmt::format("{}: {}", at.endpoint->url, full->reason));
    at.calls.erase(id);
  } else if (const auto* not_begun = std::get_if<NotBegun>(&verdict)) {
    running->call->decline(fmt::format("{}: {}", at.endpoint->url, not_begun->reason));
    at.calls.erase(id);
    if (served != nullptr) {
      constexpr unsigned most_counted = 8;
      served->not_begun = std::min(served->not_begun + 1, most_counted);
      take_down(*served, fmt::format("the endpoint {} does not answer: {}", at.endpoint->url,
                                     not_begun->reason));
    }
  } else {
    lose(number, id, std::get<Lost>(verdict).reason);
  }
}

void Host::end(Announced& at, fabric::CallId id, const sdk::Response& response) {
  const auto node = at.calls.extract(id);
  node.mapped().call->answer(response);
}

void Host::lose(Number number, fabric::CallId id, const std::string& reason) {
  Announced& at = announced_.at(number);
  Served* const served = served_of(number);
  if (served != nullptr) {
    served->next_check = Clock::now();
  }
  if (at.endpoint->announcement.delivery == fabric::Delivery::at_least_once) {
    // To the gateway it is as good as not begun: it may run again.
    const auto node = at.calls.extract(id);
    node.mapped().call->decline(fmt::format("{}: connection lost: {}", at.endpoint->url, reason));
    return;
  }
  at.calls.at(id).lost = true;
  log_->warn(
      "call {}: {} may have run it, and the connection was lost: {}; it must not run twice, so it "
      "is held for an operator when this instance has left",
      id.to_string(), at.endpoint->url, reason);
  if (served != nullptr) {
    drain(*served);
  }
}

void Host::look_at_result(Number number, RunningCall& running, Time now) {
  running.next.reset();
  running.transfer =
      transfers_.start({.endpoint = announced_.at(number).endpoint,
                        .url = running.result_url,
                        .limit = left_until(running.end, now)},
                       [this, number, id = running.call->id()](const Exchange& exchange) {
                         ended(number, id, exchange);
                       });
}

void Host::on_time(Time now) {
  if (!stopping_) {
    reload_if_changed(now);
    for (Served& served : served_) {
      if (served.recovered_at <= now) {
        recover(served);
      }
      if (!served.check && served.next_check <= now) {
        check(served, now);
      }
    }
  }
  for (auto place = announced_.begin(); place != announced_.end();) {
    auto& [number, at] = *place;
    std::vector<fabric::CallId> late;
    for (auto& [id, running] : at.calls) {
      if (running.next && running.end <= now) {
        late.push_back(id);
      } else if (running.next && *running.next <= now) {
        running.result_url.empty() ? post(number, running, now)
                                   : look_at_result(number, running, now);
      }
    }
    for (const fabric::CallId& id : late) {
      ended(number, id, {.end = Exchange::End::time_limit});
    }
    const bool leaves =
        at.leaves_at && *at.leaves_at <= now &&
        std::ranges::all_of(at.calls, [](const auto& call) { return call.second.lost; });
    place = leaves ? announced_.erase(place) : std::next(place);
  }
}

milliseconds Host::until_next(Time now) const {
  Time next = now + look_period;
  for (const Served& served : served_) {
    if (!served.check && !stopping_) {
      next = std::min(next, served.next_check);
    }
  }
  for (const auto& [number, at] : announced_) {
    next = at.leaves_at ? std::min(next, std::max(*at.leaves_at, now + milliseconds(10))) : next;
    for (const auto& [id, running] : at.calls) {
      next = running.next ? std::min(next, *running.next) : next;
    }
  }
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(next - now));
}

}  // namespace millrace::services::http
