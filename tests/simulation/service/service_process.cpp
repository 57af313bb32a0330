#include "tests/simulation/service/service_process.hpp"

#include <utility>

#include <fmt/format.h>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

namespace sdk = services::sdk;

namespace {

/// services/sdk/instance.cpp
constexpr Time drain_grace = 100ms;

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
  identity_.concurrency = plan_.concurrency;
  if (const auto born = process().agenda().meaning(identity_.id.to_string(), random_.state())) {
    process().agenda().becomes(process().parties() | process().outbox(), *born);
  }
  open_desk();
  asked_.clear();
  desk_knows_ = 0;
  closing_ = false;
  closed_ = false;
  stuck_ = false;
  note("starts as instance " + identity_.id.to_string().substr(0, 8));
  joined(fabric().join(process(), *this, identity_));
}

void ServiceProcess::open_desk() {
  desk_.emplace(sdk::DeskOptions{
      .instance = identity_.id, .concurrency = plan_.concurrency, .delivery = plan_.delivery});
}

void ServiceProcess::kill() {
  if (!process().running()) {
    return;
  }
  note("is killed");
  leave(false);
  desk_.reset();
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
  closed_ = closed_ || desk_->idle();
  if (closed_) {
    leave_soon();
  }
}

void ServiceProcess::leave_soon() {
  process().after(Time{}, [this] {
    note("leaves");
    leave(true);
    desk_.reset();
    process().end();
  });
}

std::string ServiceProcess::place() const {
  if (!running()) {
    return {};
  }
  return fmt::format("{} {} {} {} {} {} {}", identity_.id.to_string(), identity_.draining, closing_,
                     closed_, stuck_, desk_knows_, fabric().place_of(*end()));
}

void ServiceProcess::told(const std::string& what) {
  desk_knows_ = meaning_of(desk_knows_, what);
}

void ServiceProcess::calm_down() {
  plan_.habits.stuck = 0;
  plan_.habits.refused = 0;
  calm_ = true;
}

fabric::Moment ServiceProcess::moment() const {
  return {fabric::SteadyTime(Member::now()), wall()};
}

void ServiceProcess::on_request(const fabric::Request& request) {
  if (closed_) {
    return;
  }
  if (plan_.bug == Bug::desk_without_memory) {
    open_desk();
  }
  told(fmt::format("{} {} {}", request.call.to_string(), request.attempt,
                   request.assigned.to_string()));
  asked_.insert(key_of(request));
  perform(desk_->on_request(request, moment()));
}

void ServiceProcess::on_withdrawn(const fabric::RequestKey& key) {
  told(fmt::format("withdrawn {}", key.epoch));
  if (plan_.bug == Bug::withdraws_for_others) {
    for (const fabric::RequestKey& asked : asked_) {
      if (asked.key == key.key) {
        perform(desk_->on_withdrawn(asked));
      }
    }
    return;
  }
  perform(desk_->on_withdrawn(key));
}

void ServiceProcess::on_orphaned(const fabric::RequestKey& key) {
  told(fmt::format("orphaned {}", key.epoch));
  perform(desk_->on_orphaned(key));
}

void ServiceProcess::perform(const sdk::Actions& actions) {
  for (const sdk::Action& action : actions) {
    std::visit([this](const auto& each) { perform(each); }, action);
  }
  if (closing_ && !closed_ && desk_->idle()) {
    closed_ = true;
    leave_soon();
  }
}

void ServiceProcess::perform(const sdk::Start& start) {
  // The handler's thread wakes.
  process().after(random_.between(Time{}, 200us),
                  [this, request = start.request] { handle(request); });
}

void ServiceProcess::perform(const sdk::Send& send) {
  fabric().publish(*end(), send.reply);
}

void ServiceProcess::perform(const sdk::Cancel& cancel) {
  history().add(Cancelled{identity_.id, cancel.call});
}

void ServiceProcess::handle(const fabric::Request& request) {
  history().add(Started{identity_.id, request, plan_.delivery});
  if (random_.chance(plan_.habits.stuck)) {
    stuck_ = true;
    return;
  }
  Time end = random_.mostly(100us, 20ms, calm_ ? 200ms : 2000ms, plan_.habits.slow);
  if (random_.chance(plan_.habits.interim)) {
    const auto count = 1 + random_.below(3);
    for (std::size_t i = 0; i < count; ++i) {
      const auto state = static_cast<std::uint32_t>(
          first_interim + random_.below(last_interim - first_interim + 1));
      process().timer(random_.between(Time{}, end), [this, request, state] {
        perform(
            desk_->on_interim(request.call, {answer_to(request.text) + " soon", state}, moment()));
      });
    }
  }
  process().after(end, [this, request] { finish(request); });
}

void ServiceProcess::finish(const fabric::Request& request) {
  history().add(Finished{identity_.id, request.call});
  sdk::Result result = sdk::Response{answer_to(request.text), 1};
  if (random_.chance(plan_.habits.fails)) {
    result = tl::unexpected(failure_of(request.text));
  } else if (random_.chance(plan_.habits.refused)) {
    result = random_.chance(50) ? sdk::Response{answer_to(request.text), 0}
                                : sdk::Response{std::string(200, 'x'), 1};
  }
  told("result of " + request.call.to_string());
  perform(desk_->on_result(request.call, result, moment()));
}

}  // namespace millrace::tests::simulation
