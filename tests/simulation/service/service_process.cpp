#include "tests/simulation/service/service_process.hpp"

#include <utility>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

namespace sdk = services::sdk;

namespace {

constexpr fabric::Time epoch{std::chrono::hours(24 * 365 * 55)};

/// services/sdk/instance.cpp
constexpr Time drain_grace = 100ms;

}  // namespace

ServiceProcess::ServiceProcess(ServicePlan plan, Agenda& agenda, Party party, History& history,
                               Fabric& fabric, Random random)
    : plan_(std::move(plan)),
      agenda_(agenda),
      history_(history),
      fabric_(fabric),
      random_(random),
      process_(agenda, party) {}

fabric::Time ServiceProcess::now() const {
  return epoch + agenda_.now() + clock_error_;
}

void ServiceProcess::start() {
  if (process_.running()) {
    return;
  }
  process_.start();
  identity_ = {};
  for (std::uint8_t& byte : identity_.id.bytes) {
    byte = static_cast<std::uint8_t>(random_.next());
  }
  identity_.uuid = fabric::canonical_uuid(plan_.uuid);
  identity_.name = plan_.name;
  identity_.channels = plan_.channels;
  identity_.delivery = plan_.delivery;
  identity_.concurrency = plan_.concurrency;
  desk_.emplace(sdk::DeskOptions{.instance = identity_.id, .concurrency = plan_.concurrency});
  closing_ = false;
  closed_ = false;
  stuck_ = false;
  history_.note(plan_.name, "starts as instance " + identity_.id.to_string().substr(0, 8));
  end_ = fabric_.join(process_, *this, identity_);
}

void ServiceProcess::kill() {
  if (!process_.running()) {
    return;
  }
  history_.note(plan_.name, "is killed");
  fabric_.leave(*std::exchange(end_, {}), false);
  desk_.reset();
  process_.end();
}

void ServiceProcess::drain() {
  if (!process_.awake() || identity_.draining) {
    return;
  }
  history_.note(plan_.name, "drains");
  identity_.draining = true;
  fabric_.change_identity(*end_, identity_);
  process_.timer(drain_grace, [this] { close_when_idle(); });
}

void ServiceProcess::close_when_idle() {
  closing_ = true;
  closed_ = closed_ || desk_->idle();
  if (closed_) {
    leave();
  }
}

void ServiceProcess::leave() {
  process_.after(Time{}, [this] {
    history_.note(plan_.name, "leaves");
    fabric_.leave(*std::exchange(end_, {}), true);
    desk_.reset();
    process_.end();
  });
}

void ServiceProcess::freeze() {
  if (!process_.awake()) {
    return;
  }
  history_.note(plan_.name, "is frozen");
  frozen_at_ = agenda_.now();
  process_.freeze();
  fabric_.frozen(*end_);
}

void ServiceProcess::thaw() {
  if (!process_.frozen()) {
    return;
  }
  history_.note(plan_.name, "goes on");
  process_.thaw();
  fabric_.thawed(*end_, agenda_.now() - frozen_at_);
}

void ServiceProcess::calm_down() {
  plan_.habits.stuck = 0;
  plan_.habits.refused = 0;
  calm_ = true;
}

void ServiceProcess::on_request(const fabric::Request& request) {
  if (closed_) {
    return;
  }
  if (plan_.bug == Bug::desk_without_memory) {
    desk_.emplace(sdk::DeskOptions{.instance = identity_.id, .concurrency = plan_.concurrency});
  }
  perform(desk_->on_request(request, now()));
}

void ServiceProcess::on_withdrawn(const Key& key) {
  perform(desk_->on_withdrawn(key));
}

void ServiceProcess::perform(const sdk::Actions& actions) {
  for (const sdk::Action& action : actions) {
    std::visit([this](const auto& each) { perform(each); }, action);
  }
  if (closing_ && !closed_ && desk_->idle()) {
    closed_ = true;
    leave();
  }
}

void ServiceProcess::perform(const sdk::Start& start) {
  // The handler's thread wakes.
  process_.after(random_.between(Time{}, 200us),
                 [this, request = start.request] { handle(request); });
}

void ServiceProcess::perform(const sdk::Send& send) {
  fabric_.publish(*end_, send.reply);
}

void ServiceProcess::perform(const sdk::Cancel& cancel) {
  history_.note(plan_.name, "call is withdrawn: " + cancel.call.to_string());
}

void ServiceProcess::handle(const fabric::Request& request) {
  history_.add(Started{identity_.id, request, plan_.delivery});
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
      process_.timer(random_.between(Time{}, end), [this, request, state] {
        perform(desk_->on_interim(request.call, {answer_to(request.text) + " soon", state}, now()));
      });
    }
  }
  process_.after(end, [this, request] { finish(request); });
}

void ServiceProcess::finish(const fabric::Request& request) {
  history_.add(Finished{identity_.id, request.call});
  sdk::Result result = sdk::Response{answer_to(request.text), 1};
  if (random_.chance(plan_.habits.fails)) {
    result = tl::unexpected(failure_of(request.text));
  } else if (random_.chance(plan_.habits.refused)) {
    result = random_.chance(50) ? sdk::Response{answer_to(request.text), 0}
                                : sdk::Response{std::string(200, 'x'), 1};
  }
  perform(desk_->on_result(request.call, result, now()));
}

}  // namespace millrace::tests::simulation
