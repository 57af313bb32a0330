#include "tools/recording/call.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "fabric/words.hpp"

namespace millrace::tools::recording {

namespace {

Stage stage_of(fabric::EventKind kind) {
  switch (kind) {
    case fabric::EventKind::seen:
      return Stage::seen;
    case fabric::EventKind::unserved:
      return Stage::unserved;
    case fabric::EventKind::dispatched:
      return Stage::dispatched;
    case fabric::EventKind::interim:
      return Stage::interim;
    case fabric::EventKind::replied:
      return Stage::replied;
    case fabric::EventKind::written:
      return Stage::written;
    case fabric::EventKind::withdrawn:
      return Stage::withdrawn;
    case fabric::EventKind::lost:
      return Stage::lost;
    case fabric::EventKind::late:
      return Stage::late;
    case fabric::EventKind::refused:
      return Stage::refused;
    case fabric::EventKind::held:
      return Stage::held;
  }
  return Stage::seen;
}

bool ends(const Step& step) {
  return step.stage == Stage::written || step.stage == Stage::withdrawn;
}

/// Request and event get their times one after the other; a writer that is discovered again
/// delivers its last sample again.
bool is_same(const Step& a, const Step& b) {
  return a.stage == b.stage && a.attempt == b.attempt &&
         (a.stage == Stage::seen || a.stage == Stage::dispatched ||
          (a.at == b.at && a.text == b.text && a.state == b.state));
}

}  // namespace

std::string_view name_of(Stage stage) {
  constexpr std::array<std::string_view, 16> names{"seen by the gateway",
                                                   "no service has this UUID",
                                                   "dispatched",
                                                   "received by the instance",
                                                   "handler started",
                                                   "interim reply of the instance",
                                                   "interim state shown",
                                                   "answered by the instance",
                                                   "declined by the instance",
                                                   "reply at the gateway",
                                                   "reply refused",
                                                   "instance lost",
                                                   "held for an operator",
                                                   "late reply dropped",
                                                   "withdrawn by the program",
                                                   "written back"};
  return names.at(static_cast<std::size_t>(stage));
}

std::string_view event_name_of(Stage stage) {
  for (int kind = 0; kind <= static_cast<int>(fabric::EventKind::held); ++kind) {
    const auto event = static_cast<fabric::EventKind>(kind);
    if (stage_of(event) == stage) {
      return fabric::name_of(event);
    }
  }
  return {};
}

std::string_view name_of(Outcome outcome) {
  constexpr std::array<std::string_view, 5> names{"under way", "answered", "failed", "settled",
                                                  "withdrawn"};
  return names.at(static_cast<std::size_t>(outcome));
}

bool Call::add(const Entry& entry) {
  if (call_of(entry) != id) {
    return false;
  }
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    add(*request, entry);
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    add(*reply, entry);
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    add(*event, entry);
  } else {
    return false;
  }
  key = *channel_of(entry);
  if (!entry.uuid.empty()) {
    uuid = entry.uuid;
  }
  return true;
}

void Call::add(const fabric::Request& request, const Entry& entry) {
  replayed = replayed || request.replayed;
  uuid = fabric::canonical_uuid(request.uuid);
  add({.stage = Stage::seen,
       .at = request.seen,
       .received = entry.at,
       .text = request.text,
       .withheld = entry.withheld,
       .state = request.state});
  add({.stage = Stage::dispatched,
       .at = request.dispatched,
       .received = entry.at,
       .attempt = request.attempt,
       .instance = request.assigned});
}

void Call::add(const fabric::Reply& reply, const Entry& entry) {
  const auto of_instance = [&](Stage stage, fabric::Time at) {
    return Step{.stage = stage,
                .at = at,
                .received = entry.at,
                .attempt = reply.attempt,
                .by_service = true,
                .instance = reply.instance};
  };
  if (reply.received != fabric::Time{}) {
    add(of_instance(Stage::received, reply.received));
  }
  if (reply.started != fabric::Time{}) {
    add(of_instance(Stage::started, reply.started));
  }
  if (!fabric::is_known(reply)) {
    return;  // It answers nothing.
  }
  const bool declined = reply.kind == fabric::ReplyKind::declined;
  Step step = of_instance(declined                                   ? Stage::declined
                          : reply.kind == fabric::ReplyKind::interim ? Stage::interim_reply
                                                                     : Stage::answered,
                          reply.answered);
  step.failure = is_failure(entry);
  step.code = reply.code;
  step.state = reply.state;
  step.withheld = entry.withheld;
  if (declined) {
    step.detail = reply.reason.empty() ? fabric::Message(reply.text) : reply.reason;
  } else {
    step.text = reply.text;
  }
  add(std::move(step));
}

void Call::add(const fabric::Event& event, const Entry& entry) {
  replayed = replayed || event.replayed;
  uuid = fabric::canonical_uuid(event.uuid);
  if (event.kind > fabric::EventKind::held) {
    return;  // A step that only a later version knows.
  }
  const Stage stage = stage_of(event.kind);
  const bool of_the_call = stage == Stage::seen;
  add({.stage = stage,
       .at = event.at,
       .received = entry.at,
       .attempt = of_the_call ? 0 : event.attempt,
       .instance = of_the_call ? fabric::InstanceId{} : event.instance,
       .failure = is_failure(entry),
       .text = event.text,
       .withheld = entry.withheld,
       .state = event.state,
       .detail = event.detail});
}

void Call::add(Step step) {
  if (texts == Texts::left_out) {
    step.text.clear();
    step.detail.clear();
  }
  const auto same =
      std::ranges::find_if(steps, [&](const Step& known) { return is_same(known, step); });
  if (same == steps.end()) {
    steps.push_back(std::move(step));
    return;
  }
  if (same->detail.empty()) {
    same->detail = step.detail;
  }
  if (same->at == fabric::Time{}) {
    same->at = step.at;
  }
}

const Step* Call::first(Stage stage) const {
  const auto found = std::ranges::find(steps, stage, &Step::stage);
  return found == steps.end() ? nullptr : &*found;
}

const Step* Call::last(Stage stage) const {
  const auto found = std::find_if(steps.rbegin(), steps.rend(),
                                  [&](const Step& step) { return step.stage == stage; });
  return found == steps.rend() ? nullptr : &*found;
}

const Step* Call::of_attempt(Stage stage, std::uint32_t attempt) const {
  const auto found = std::find_if(steps.rbegin(), steps.rend(), [&](const Step& step) {
    return step.stage == stage && step.attempt == attempt;
  });
  return found == steps.rend() ? nullptr : &*found;
}

const Step* Call::end() const {
  const auto found = std::ranges::find_if(steps, ends);
  return found == steps.end() ? nullptr : &*found;
}

const Step* Call::newest() const {
  if (const Step* const over = end()) {
    return over;
  }
  // A gateway decides several steps at one time, and observers may receive them in any order.
  const auto when = [](const Step& step) { return std::tuple(step.at, step.attempt, step.stage); };
  const Step* newest = nullptr;
  for (const Step& step : steps) {
    const bool concerns_an_attempt = !step.by_service && step.stage != Stage::seen &&
                                     step.stage != Stage::unserved && step.stage != Stage::late;
    if (concerns_an_attempt && (newest == nullptr || when(step) >= when(*newest))) {
      newest = &step;
    }
  }
  return newest;
}

Outcome Call::outcome() const {
  const Step* const over = end();
  if (over == nullptr) {
    return Outcome::under_way;
  }
  if (over->stage == Stage::withdrawn) {
    return Outcome::withdrawn;
  }
  if (over->instance == fabric::InstanceId{}) {
    return Outcome::settled;
  }
  return is_error(*over) ? Outcome::failed : Outcome::answered;
}

bool Call::is_error(const Step& written) const {
  const std::uint32_t attempt = attempt_of(written);
  const auto of_the_attempt = [&](const Step& step, Stage stage) {
    return step.stage == stage && attempt_of(step) == attempt;
  };
  bool reply_known = false;
  for (const Step& step : steps) {
    if (of_the_attempt(step, Stage::answered) && step.text == written.text &&
        step.state == written.state) {
      if (!step.failure) {
        return false;
      }
      reply_known = true;
    }
  }
  return reply_known || std::ranges::any_of(steps, [&](const Step& step) {
           return of_the_attempt(step, Stage::refused);
         });
}

std::uint32_t Call::attempt_of(const Step& step) const {
  std::uint32_t attempt = step.attempt;
  for (const Step& given : steps) {
    if (step.attempt == 0 && given.stage == Stage::dispatched && given.instance == step.instance) {
      attempt = std::max(attempt, given.attempt);
    }
  }
  return attempt;
}

std::optional<std::chrono::nanoseconds> Call::duration() const {
  const Step* const begin = first(Stage::seen);
  const Step* const over = end();
  if (begin == nullptr || over == nullptr || begin->at == fabric::Time{} ||
      over->at == fabric::Time{}) {
    return std::nullopt;
  }
  return over->at - begin->at;
}

void InstanceNames::add(const Entry& entry) {
  const auto* const news = std::get_if<InstanceNews>(&entry.sample);
  if (news != nullptr && news->change != Change::gone) {
    names_.insert_or_assign(news->identity.id, Name{news->identity.name, news->identity.host});
  }
}

InstanceNames::Name InstanceNames::of(const fabric::InstanceId& instance) const {
  const auto known = names_.find(instance);
  return known == names_.end() ? Name{} : known->second;
}

std::optional<Call> CallFollower::add(const Entry& entry) {
  const fabric::CallId id = call_of(entry);
  if (id == fabric::CallId{}) {
    return std::nullopt;  // A request without a service is not a call yet.
  }
  const auto* const event = std::get_if<fabric::Event>(&entry.sample);
  if (event == nullptr) {
    const fabric::ChannelKey* const key = channel_of(entry);
    const auto known = key == nullptr ? under_way_.end() : under_way_.find(*key);
    if (known != under_way_.end()) {
      known->second.add(entry);
    }
    return std::nullopt;
  }
  Call& call = under_way_[event->key];
  if (call.id != id) {
    call = Call(id);
  }
  call.add(entry);
  if (call.end() == nullptr) {
    return std::nullopt;
  }
  std::optional<Call> ended = std::move(call);
  under_way_.erase(event->key);
  return ended;
}

namespace {

bool is_complete(const Call& call) {
  const Step* const end = call.end();
  return end != nullptr && (end->stage == Stage::withdrawn ||
                            (call.of_attempt(Stage::answered, end->attempt) != nullptr &&
                             call.of_attempt(Stage::dispatched, call.attempt_of(*end)) != nullptr));
}

}  // namespace

std::vector<Call> CallCollector::add(const Entry& entry) {
  std::vector<Call> complete;
  const fabric::CallId id = call_of(entry);
  const bool shows_a_step = std::holds_alternative<fabric::Event>(entry.sample) ||
                            std::holds_alternative<fabric::Request>(entry.sample) ||
                            std::holds_alternative<fabric::Reply>(entry.sample);
  if (!shows_a_step || id == fabric::CallId{} || closed_.contains(id)) {
    return complete;
  }
  if (!open_.contains(id)) {
    if (auto oldest = open_.put(id, Call(id, texts_))) {
      closed_.put(oldest->key);
      complete.push_back(std::move(oldest->value));
    }
  }
  Call& call = *open_.find(id);
  call.add(entry);
  if (is_complete(call)) {
    complete.push_back(std::move(call));
    open_.erase(id);
    closed_.put(id);
  }
  return complete;
}

std::vector<Call> CallCollector::close() {
  std::vector<Call> rest;
  for (auto& [id, call] : open_) {
    rest.push_back(std::move(call));
  }
  open_.clear();
  return rest;
}

}  // namespace millrace::tools::recording
