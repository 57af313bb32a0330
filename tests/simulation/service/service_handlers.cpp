// The handlers of a service.
#include "tests/simulation/service/service_process.hpp"
#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

namespace sdk = services::sdk;

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
  told("result of " + call.to_string());
  const sdk::Actions actions = scheduler_->on_result(call, result, moment());
  if (plan_.bug == Bug::cancelled_result_sent && run->cancelled && result) {
    fabric::Reply reply;
    reply.key = run->request.key;
    reply.instance = identity_.id;
    reply.call = call;
    reply.attempt = run->request.attempt;
    reply.text = result->text;
    reply.state = result->state;
    reply.asked_text = run->request.text;
    reply.asked_state = run->request.state;
    say(reply);
  }
  perform(actions);
}

}  // namespace millrace::tests::simulation
