#include "tests/simulation/service/service_process.hpp"

#include <utility>

#include <fmt/format.h>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {
namespace sdk = services::sdk;

namespace {

/// fabric/endpoints/command_endpoint.hpp
constexpr Time drain_grace = 100ms;
/// A quarter of the usual lease: fabric/endpoints/liveness_monitor.hpp
constexpr Time heartbeat_period = 125ms;

}  // namespace

ServiceProcess::ServiceProcess(ServicePlan plan, Agenda& agenda, Party party, History& history,
                               Fabric& fabric, Random random)
    : Member(plan.name, agenda, party, history, fabric), plan_(std::move(plan)), random_(random) {}

void ServiceProcess::start() {
  if (process().running()) {
    return;
  }
  process().start();
  identity_ = {};
  for (std::uint8_t& byte : identity_.id.bytes) {
    byte = static_cast<std::uint8_t>(random_.next());
  }
  identity_.uuid = fabric::canonical_uuid(plan_.uuid);
  identity_.name = plan_.name;
  identity_.channels = plan_.channels;
  identity_.delivery = plan_.delivery;
  identity_.completion_signal = plan_.completion_signal;
  identity_.concurrency = plan_.concurrency;
  if (const auto born = process().agenda().meaning(identity_.id.to_string(), random_.state())) {
    process().agenda().becomes(process().parties() | process().outbox(), *born);
  }
  open_scheduler();
  asked_.clear();
  runs_.clear();
  garbled_.clear();
  last_answer_ = {};
  scheduler_knows_ = 0;
  closing_ = false;
  closed_ = false;
  stuck_ = false;
  note("starts as instance " + identity_.id.to_string().substr(0, 8));
  joined(fabric().join(process(), *this, identity_));
  if (plan_.heartbeats) {
    heartbeat();
  }
}

void ServiceProcess::heartbeat() {
  process().timer(heartbeat_period, [this] {
    fabric().heartbeat(*end(), scheduler_->load());
    heartbeat();
  });
}

void ServiceProcess::open_scheduler() {
  scheduler_.emplace(sdk::CallSchedulerOptions{.instance = identity_.id,
                                               .concurrency = plan_.concurrency,
                                               .delivery = plan_.delivery,
                                               .completion_signal = plan_.completion_signal});
}

void ServiceProcess::kill() {
  if (!process().running()) {
    return;
  }
  note("is killed");
  leave(false);
  scheduler_.reset();
  process().end();
}

void ServiceProcess::drain() {
  if (!process().awake() || identity_.draining) {
    return;
  }
  note("drains");
  identity_.draining = true;
  fabric().change_identity(*end(), identity_);
  process().timer(drain_grace, [this] { close_when_idle(); });
}

void ServiceProcess::close_when_idle() {
  closing_ = true;
  closed_ = closed_ || scheduler_->idle();
  if (closed_) {
    leave_soon();
  }
}

void ServiceProcess::leave_soon() {
  process().after(Time{}, [this] {
    note("leaves");
    leave(true);
    scheduler_.reset();
    process().end();
  });
}

std::string ServiceProcess::place() const {
  if (!running()) {
    return {};
  }
  return fmt::format("{} {} {} {} {} {} {}", identity_.id.to_string(), identity_.draining, closing_,
                     closed_, stuck_, scheduler_knows_, fabric().place_of(*end()));
}

void ServiceProcess::note_input(const std::string& what) {
  scheduler_knows_ = meaning_of(scheduler_knows_, what);
}

void ServiceProcess::calm_down() {
  plan_.behaviour.stuck = 0;
  plan_.behaviour.refused = 0;
  calm_ = true;
}

fabric::Moment ServiceProcess::moment() const {
  return {fabric::SteadyTime(Member::now()), wall()};
}

void ServiceProcess::on_request(const fabric::Request& request) {
  if (closed_) {
    perform(scheduler_->decline(request, "it is leaving"));
    return;
  }
  if (plan_.bug == Bug::scheduler_without_memory) {
    open_scheduler();
  }
  note_input(fmt::format("{} {} {}", request.call.to_string(), request.attempt,
                         request.assigned.to_string()));
  asked_.insert(key_of(request));
  perform(scheduler_->on_request(request, moment()));
}

void ServiceProcess::on_withdrawn(const fabric::RequestKey& key) {
  note_input(fmt::format("withdrawn {}", key.epoch));
  if (plan_.bug == Bug::withdraws_for_others) {
    for (const fabric::RequestKey& asked : asked_) {
      if (asked.key == key.key) {
        perform(scheduler_->on_withdrawn(asked));
      }
    }
    return;
  }
  perform(scheduler_->on_withdrawn(key));
}

void ServiceProcess::on_orphaned(const fabric::RequestKey& key) {
  note_input(fmt::format("orphaned {}", key.epoch));
  perform(scheduler_->on_orphaned(key));
}

void ServiceProcess::perform(const sdk::Actions& actions) {
  for (const sdk::Action& action : actions) {
    std::visit([this](const auto& each) { perform(each); }, action);
  }
  if (closing_ && !closed_ && scheduler_->idle()) {
    closed_ = true;
    leave_soon();
  }
}

void ServiceProcess::perform(const sdk::Start& start) {
  const auto run = std::make_shared<Run>();
  run->request = start.request;
  run->obeys = random_.chance(plan_.behaviour.obeys);
  runs_[start.request.call] = run;
  // The time until the handler's thread wakes.
  process().after(random_.between(Time{}, 200us), [this, run] { handle(run); });
}

void ServiceProcess::perform(const sdk::Send& send) {
  fabric::Reply reply = send.reply;
  if (plan_.foreign && reply.kind == fabric::ReplyKind::final) {
    if (plan_.counts_no_attempts) {
      reply.attempt = 0;
    }
    reply.answered = wall();
    const auto garbled = garbled_.find(reply.call);
    if (garbled != garbled_.end()) {
      reply.text = garbled->second.text;
      reply.state = garbled->second.state;
    }
    if (garbled != garbled_.end() || random_.chance(5)) {
      reply.code = static_cast<fabric::ServiceCode>(random_.below(4));
    }
  }
  say(std::move(reply));
}

void ServiceProcess::perform(const sdk::Cancel& cancel) {
  history().add(Cancelled{identity_.id, cancel.call});
  const auto found = runs_.find(cancel.call);
  if (found == runs_.end() || found->second->ended) {
    return;
  }
  const RunPointer run = found->second;
  run->cancelled = true;
  if (run->obeys) {
    process().after(random_.between(Time{}, 5ms), [this, run] { finish(run); });
  }
}

void ServiceProcess::say(fabric::Reply reply) {
  history().add(Replied{identity_.id, reply});
  if (reply.kind == fabric::ReplyKind::final) {
    last_answer_ = reply;
  }
  fabric().publish(*end(), reply);
}

void ServiceProcess::speak_again(const fabric::CallId& call) {
  if (!process().awake() || last_answer_.call != call) {
    return;
  }
  fabric::Reply reply = last_answer_;
  if (random_.chance(50)) {
    reply.kind = fabric::ReplyKind::interim;
    reply.state = first_interim;
  } else {
    reply.text += " again";
    reply.state = random_.chance(50) ? reply.state + 1 : 0;
  }
  history().add(Replied{identity_.id, reply});
  fabric().publish(*end(), reply);
}

// The handlers of a service.

void ServiceProcess::handle(const RunPointer& run) {
  if (run->ended) {
    return;
  }
  const fabric::Request& request = run->request;
  history().add(Started{identity_.id, request, plan_.delivery});
  if (random_.chance(plan_.behaviour.stuck)) {
    stuck_ = true;
    return;
  }
  const Time end = random_.mostly(100us, 20ms, calm_ ? 200ms : 2000ms, plan_.behaviour.slow);
  if (random_.chance(plan_.behaviour.interim)) {
    const auto count = 1 + random_.below(3);
    for (std::size_t i = 0; i < count; ++i) {
      const auto state = static_cast<std::uint32_t>(
          first_interim + random_.below(last_interim - first_interim + 1));
      sdk::Response response{answer_to(request) + in_progress, state};
      if (random_.chance(plan_.behaviour.refused)) {
        response = garbage(request);
      }
      // Also when it has answered.
      process().timer(random_.between(Time{}, end + end / 8),
                      [this, run, response] { say_meanwhile(run, response); });
    }
  }
  process().after(end, [this, run] { finish(run); });
}

void ServiceProcess::say_meanwhile(const RunPointer& run, const sdk::Response& response) {
  // As in sdk::Call, which throws for such a text. It also asks whether the call has its answer,
  // which may arrive immediately afterwards.
  const bool takes = plan_.foreign || sdk::check_text(response.text).empty();
  if (takes && !run->cancelled && runs_[run->request.call] == run) {
    perform(scheduler_->on_interim(run->request.call, response, moment()));
  }
}

sdk::Response ServiceProcess::garbage(const fabric::Request& request) {
  switch (random_.below(3)) {
    case 0:
      return waits_for_response() ? sdk::Response{"", 1} : sdk::Response{answer_to(request), 0};
    case 1:
      return {std::string(200, 'x'), 1};
    default:
      return {answer_to(request) + '\0', 1};
  }
}

sdk::Result ServiceProcess::result_of(const Run& run) {
  const std::string answer = answer_to(run.request);
  if (run.cancelled) {
    return sdk::Response{unwanted + answer, 1};
  }
  garbled_.erase(run.request.call);
  if (random_.chance(plan_.behaviour.fails)) {
    return tl::unexpected(failure_of(answer));
  }
  if (random_.chance(plan_.behaviour.refused)) {
    const sdk::Response response = garbage(run.request);
    if (!plan_.foreign) {
      return response;
    }
    garbled_[run.request.call] = response;
  }
  return sdk::Response{answer, waits_for_response() && random_.chance(50) ? 0U : 1U};
}

void ServiceProcess::finish(const RunPointer& run) {
  if (run->ended) {
    return;
  }
  run->ended = true;
  const fabric::CallId call = run->request.call;
  history().add(Finished{identity_.id, call});
  const sdk::Result result = result_of(*run);
  note_input("result of " + call.to_string());
  const sdk::Actions actions = scheduler_->on_result(call, result, moment());
  if (plan_.bug == Bug::cancelled_result_sent && run->cancelled && result) {
    say(reply_to(run->request, result->text, result->state));
  }
  perform(actions);
}

}  // namespace millrace::tests::simulation
