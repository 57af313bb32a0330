#include "fabric/observer/observer.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/dds/listeners.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/gateway_monitor.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/tell.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/observer/alarms.hpp"
#include "fabric/observer/context.hpp"
#include "fabric/observer/loads.hpp"
#include "fabric/wire/subscription.hpp"

namespace millrace::fabric::observer {

namespace {

using wire::InstanceState;

/// Batches of 64 samples that are taken from one reader before the next one has its turn.
constexpr int batches_per_turn = 16;

/// A sample as an entry; nothing if it is only a change of instance state that is not observed.
template <typename Value>
std::optional<Sample> sample_of(wire::Taken<Value>&& taken) {
  if (!taken.valid) {
    return std::nullopt;
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<Request>&& taken) {
  if (taken.valid && is_withdrawal(taken.value)) {
    // The context knows the number.
    return Withdrawal{.key = std::move(taken.value.key),
                      .call = {.epoch = taken.value.call.epoch},
                      .instance = taken.value.assigned,
                      .requester = taken.value.requester};
  }
  return taken.valid ? std::optional<Sample>(std::move(taken.value)) : std::nullopt;
}

Message message_of(endpoints::Absence absence) {
  using enum endpoints::Absence;
  switch (absence) {
    case removed:
      return base::messages::machine_removed();
    case ended:
      return base::messages::gateway_released();
    case silent:
      return base::messages::gateway_not_responding();
    case gone:
      break;
  }
  return base::messages::gateway_gone();
}

/// Its gateway disposes nothing.
std::optional<Sample> sample_of(wire::Taken<DataSample>&& taken) {
  if (taken.instance_state == InstanceState::no_writers) {
    // Without its values: no gateway publishes them any more.
    return DataSample{.key = std::move(taken.value.key),
                      .group = std::move(taken.value.group),
                      .at = std::chrono::system_clock::now()};
  }
  return taken.valid ? std::optional<Sample>(std::move(taken.value)) : std::nullopt;
}

}  // namespace

struct Observer::Impl : std::enable_shared_from_this<Impl>, endpoints::GatewayMonitorListener {
  Impl(dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       ObserverListener& own_listener, Interest own_interest)
      : participant(own_participant),
        interest(own_interest),
        listener(&own_listener),
        liveness(executor, {.on_load = [this](auto, const InstanceLoad& load, bool is_theirs,
                                              SteadyTime at) { take(load, is_theirs, at); },
                            .announce = [this] { report_changes(); }}) {}

  void open(const boost::asio::any_io_executor& executor);
  void close();
  bool drain();
  void drain_discovery();
  void take(const InstanceLoad& load, bool is_theirs, SteadyTime at);
  void report_changes();
  void report_ignored();
  void warn_limited(const std::string& kind, const std::string& about, const std::string& text);
  void hand_out(Sample sample);

  template <typename Value>
  void open(wire::Subscription<Value>& samples, const std::string& partition) {
    samples = wire::Subscription<Value>(
        participant, *post, partition,
        [this](wire::Taken<Value>& taken) {
          if (taken.valid && !counts(taken)) {
            return;
          }
          cut(taken);
          if (auto sample = news_of(std::move(taken))) {
            hand_out(std::move(*sample));
          }
        },
        wire::SubscriptionOptions{
            .batches_per_turn = batches_per_turn,
            .on_flooding = [this](const std::string& line) { warn_limited("keys", line, line); }});
  }

  /// Whether the writer is allowed to publish this sample; if not, it is reported.
  template <typename Value>
  bool counts(wire::Taken<Value>& taken) {
    static_cast<void>(taken);
    return true;
  }
  bool counts(wire::Taken<Event>& taken);
  bool counts(wire::Taken<Request>& taken);
  bool counts(wire::Taken<Reply>& taken);
  bool counts(wire::Taken<Outcome>& taken);
  void ignore(dds_instance_handle_t writer, const std::string& program, const std::string& what);

  /// Cuts what is longer than any sample of a millrace process, and counts it: an observer keeps
  /// hundreds of samples. All other fields have a limit in the IDL.
  template <typename Value>
  void cut(wire::Taken<Value>& taken) {
    static_cast<void>(taken);
  }
  void cut(wire::Taken<Reply>& taken) { cut_text(replies, taken); }
  void cut(wire::Taken<Command>& taken) { cut_text(commands, taken); }
  void cut(wire::Taken<DataSample>& taken);
  template <typename Value>
  void cut_text(const wire::Subscription<Value>& from, wire::Taken<Value>& taken) {
    if (std::string& text = taken.value.text; text.size() > max_text) {
      report_cut(taken.writer, from ? from->program_of(taken.writer) : "",
                 fmt::format("a text of {} bytes; {} are kept", text.size(), max_text));
      text = text.substr(0, max_text);
    }
  }
  void report_cut(dds_instance_handle_t writer, const std::string& program,
                  const std::string& what);

  template <typename Use>
  void for_each_topic(Use use) {
    use(requests);
    use(replies);
    use(events);
    use(commands);
    use(outcomes);
    use(data);
    use(programs);
    use(alarms);
  }

  /// A sample as an entry; nothing if it is not news.
  template <typename Value>
  std::optional<Sample> news_of(wire::Taken<Value>&& taken) {
    return sample_of(std::move(taken));
  }
  std::optional<Sample> news_of(wire::Taken<Alarm>&& taken) {
    const bool is_lost = taken.instance_state == InstanceState::no_writers;
    auto kept = alarm_owners.take(taken.value.key, taken.writer, taken.valid,
                                  taken.instance_state == InstanceState::alive);
    if (!kept) {
      return std::nullopt;
    }
    taken.value.key = std::move(kept->key);
    auto news = kept->is_over ? known_alarms.over(taken.value.key, is_lost)
                              : known_alarms.on_alarm(std::move(taken.value));
    return news ? std::optional<Sample>(std::move(*news)) : std::nullopt;
  }

  void on_machine(const MachineStatus& status) override {
    if (interest != Interest::calls) {
      hand_out(status);
    }
  }
  void on_machine_gone(const std::string& machine, const InstanceId& gateway,
                       endpoints::Absence absence) override {
    // A channel or machine whose gateway left would look alive for ever.
    on_machine({.machine = machine,
                .gateway = gateway,
                .since = std::chrono::system_clock::now(),
                .reason = message_of(absence),
                .gone = true});
  }
  void on_channel(const ChannelStatus& status) override { hand_out(status); }
  void on_channel_gone(const ChannelKey& key) override {
    hand_out(ChannelStatus{.key = key,
                           .since = std::chrono::system_clock::now(),
                           .reason = base::messages::gateway_gone(),
                           .gone = true});
  }
  void on_ignored(const std::string& reason) override { listener->on_ignored(reason); }

  void drop_gone_alarms();

  dds::Participant& participant;
  const Interest interest;
  /// Null once the observer is closed.
  ObserverListener* listener;
  Context context;
  LogLimiter log_limiter;
  std::uint64_t delivered = 0;
  std::uint64_t shortened = 0;
  // Before the entities that wake it.
  std::optional<dds::PostOnce> post;
  endpoints::LivenessMonitor liveness;
  std::optional<dds::Authenticator::ChangeQueue> identity_changes;
  std::optional<endpoints::GatewayMonitor> gateways;
  Loads loads;
  wire::Subscription<Request> requests;
  wire::Subscription<Reply> replies;
  wire::Subscription<Event> events;
  wire::Subscription<Command> commands;
  wire::Subscription<Outcome> outcomes;
  wire::Subscription<DataSample> data;
  wire::Subscription<ProgramEvent> programs;
  Alarms known_alarms;
  AlarmOwners alarm_owners;
  wire::Subscription<Alarm> alarms;
};

void Observer::Impl::open(const boost::asio::any_io_executor& executor) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  if (participant.authenticator() != nullptr) {
    identity_changes.emplace(*participant.authenticator(), [this] { post->post(); });
  }
  const std::string& fabric = participant.options().fabric;
  const std::string services = wire::all_services(fabric);
  const bool all = interest == Interest::everything;
  const bool states = all || interest == Interest::states;
  const bool calls = all || interest == Interest::calls;
  if (all || interest == Interest::data) {
    open(data, fabric);
  }
  if (states || interest == Interest::data) {
    open(programs, fabric);
  }
  if (states || interest == Interest::alarms) {
    open(alarms, fabric);
  }
  if (!states && !calls) {
    return;
  }
  gateways.emplace(participant, executor, *this, endpoints::GatewayMonitor::Of::all);
  gateways->subscribe_channels();
  if (states) {
    liveness.open(participant, endpoints::Discovery::Of::tools, weak_from_this(), *post, *post,
                  batches_per_turn);
  }
  if (calls) {
    open(events, fabric);
  }
  if (all) {
    open(requests, services);
    open(replies, services);
    open(commands, fabric);
    open(outcomes, fabric);
  }
}

void Observer::Impl::close() {
  listener = nullptr;
  identity_changes.reset();
  gateways.reset();
  for_each_topic([](auto& samples) { samples.reset(); });
  liveness.close();
}

bool Observer::Impl::drain() {
  drain_discovery();
  if (gateways) {
    gateways->drain();
  }
  bool more = liveness.drain_heartbeats();
  report_changes();
  for_each_topic([&](auto& samples) { more = samples.drain() || more; });
  drop_gone_alarms();
  report_ignored();
  if (more) {
    // Others on the executor have their turn in between.
    post->post();
  }
  return more;
}

void Observer::Impl::drain_discovery() {
  if (listener != nullptr) {
    const endpoints::Discovery::News news = liveness.update();
    if (participant.authenticator() != nullptr) {
      for (const endpoints::Discovery::Ignored& ignored : news.ignored) {
        participant.authenticator()->warn_limited(ignored.kind + ignored.about, ignored.reason);
      }
    }
    report_changes();
  }
}

/// Only heartbeats whose load is news are handed out.
void Observer::Impl::take(const InstanceLoad& load, bool is_theirs, SteadyTime at) {
  if (is_theirs && loads.is_news(load.status, at)) {
    hand_out(load.status);
  }
}

void Observer::Impl::report_changes() {
  if (listener == nullptr) {
    return;
  }
  const registry::InstanceRegistry::Changes changes = liveness.changes();
  for (const InstanceId& instance : changes.gone) {
    loads.forget(instance);
    const bool is_silent = std::ranges::find(changes.silent, instance) != changes.silent.end();
    hand_out(InstanceNews{is_silent ? Change::silent : Change::gone, {.id = instance}});
  }
  for (const InstanceId& instance : changes.left) {
    hand_out(InstanceNews{Change::gone, {.id = instance}});
  }
  for (const InstanceIdentity& identity : changes.ready) {
    hand_out(InstanceNews{Change::ready, identity});
  }
  for (const InstanceIdentity& identity : changes.changed) {
    hand_out(InstanceNews{Change::changed, identity});
  }
}

void Observer::Impl::drop_gone_alarms() {
  if (listener == nullptr || !alarms) {
    return;
  }
  for (const AlarmKey& key : alarm_owners.gone(alarms->matched())) {
    if (auto news = known_alarms.over(key, true)) {
      hand_out(std::move(*news));
    }
  }
}

/// A gateway tells of calls of its own epoch.
bool Observer::Impl::counts(wire::Taken<Event>& taken) {
  const Event& event = taken.value;
  const auto is_its = gateways->has_epoch(events->participant_of(taken.writer), event.key.machine,
                                          event.call.epoch);
  if (!is_its.value_or(true)) {
    ignore(taken.writer, events->program_of(taken.writer), "publishes a call of a gateway");
  }
  return is_its.value_or(true);
}

/// And it asks under that; only who has asked takes that back.
bool Observer::Impl::counts(wire::Taken<Request>& taken) {
  const Request& request = taken.value;
  const dds_instance_handle_t who = requests->participant_of(taken.writer);
  taken.value.requester = requests->authorizer().requester_of(taken.writer, request.key.machine);
  const auto is_its = gateways->has_epoch(who, request.key.machine, request.call.epoch);
  if (is_its.value_or(!is_withdrawal(request) || context.has_asked(key_of(request)))) {
    return true;
  }
  ignore(taken.writer, requests->program_of(taken.writer),
         is_withdrawal(request) ? "cancels a call" : "sends a request in the epoch of a gateway");
  return false;
}

/// An instance answers what it was asked. It may be seen later than its reply, and so may what it
/// was asked.
bool Observer::Impl::counts(wire::Taken<Reply>& taken) {
  const Reply& reply = taken.value;
  const auto speaks = [&] { return liveness.registry().speaks_for(taken.writer, reply.instance); };
  if (!speaks()) {
    drain_discovery();
  }
  const bool is_its = speaks();
  if (is_its && !context.was_given(reply)) {
    requests.drain();
  }
  if (is_its && context.was_given(reply)) {
    return true;
  }
  if (replies) {
    ignore(taken.writer, replies->program_of(taken.writer),
           "replies to a call of instance " + reply.instance.to_string());
  }
  return false;
}

bool Observer::Impl::counts(wire::Taken<Outcome>& taken) {
  const Outcome& outcome = taken.value;
  const dds_instance_handle_t who = outcomes->participant_of(taken.writer);
  if (context.find_command(outcome.command) == nullptr) {
    commands.drain();
  }
  const auto is_its = [&] {
    const Command* const command = context.find_command(outcome.command);
    return (liveness.registry().is_home(who, outcome.responder) ||
            gateways->is_gateway(who, outcome.responder)) &&
           (command == nullptr || endpoints::is_for(who, *command, liveness.registry(), *gateways));
  };
  if (!is_its()) {
    drain_discovery();
    if (gateways) {
      gateways->drain();
    }
  }
  if (listener != nullptr && !is_its()) {
    ignore(taken.writer, outcomes->program_of(taken.writer), "publishes the outcome of a command");
    return false;
  }
  return listener != nullptr;
}

/// Each of a group's values is read in one request of 16 kB (gateway/data/sampler.hpp).
void Observer::Impl::cut(wire::Taken<DataSample>& taken) {
  constexpr std::size_t most_bytes = std::size_t{1} << 20U;
  std::size_t bytes = 0;
  const auto add = [&bytes](const auto& elements) {
    for (const auto& element : elements) {
      if constexpr (requires { element.size(); }) {
        bytes += element.size();
      }
      bytes += sizeof element;
    }
  };
  const auto first_too_many = std::ranges::find_if(taken.value.values, [&](const Value& value) {
    bytes += sizeof value;
    std::visit(add, value.elements);
    return bytes > most_bytes;
  });
  if (first_too_many != taken.value.values.end()) {
    report_cut(
        taken.writer, data ? data->program_of(taken.writer) : "",
        fmt::format("{} values of more than {} bytes; {} are kept", taken.value.values.size(),
                    most_bytes, first_too_many - taken.value.values.begin()));
    taken.value.values = {taken.value.values.begin(), first_too_many};
  }
}

void Observer::Impl::report_cut(dds_instance_handle_t writer, const std::string& program,
                                const std::string& what) {
  ++shortened;
  warn_limited("cut", std::to_string(writer),
               fmt::format("participant {} publishes {}", program, what));
}

void Observer::Impl::ignore(dds_instance_handle_t writer, const std::string& program,
                            const std::string& what) {
  warn_limited(what.substr(0, what.find(' ')), std::to_string(writer),
               fmt::format("participant {} {}, which belongs to another participant; ignored",
                           program, what));
}

void Observer::Impl::warn_limited(const std::string& kind, const std::string& about,
                                  const std::string& text) {
  if (const auto line = log_limiter.admit(kind, about, text, std::chrono::steady_clock::now())) {
    endpoints::tell(listener, &ObserverListener::on_ignored, *line);
  }
}

void Observer::Impl::report_ignored() {
  if (participant.authenticator() == nullptr || listener == nullptr) {
    return;
  }
  if (identity_changes) {
    // It has only to look again.
    static_cast<void>(identity_changes->take());
  }
  for (const std::string& line : participant.authenticator()->take_warnings()) {
    endpoints::tell(listener, &ObserverListener::on_ignored, line);
  }
}

void Observer::Impl::hand_out(Sample sample) {
  if (listener == nullptr) {
    return;
  }
  ++delivered;
  Entry entry{.at = std::chrono::system_clock::now(), .sample = std::move(sample)};
  context.complete(entry);
  listener->on_entry(std::move(entry));
}

Observer::Observer(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                   ObserverListener& listener, Interest interest)
    : impl_(std::make_shared<Impl>(participant, executor, listener, interest)) {
  impl_->open(executor);
}

Observer::~Observer() {
  impl_->close();
}

bool Observer::drain() {
  return impl_->drain();
}

Counts Observer::counts() const {
  Counts counts{.delivered = impl_->delivered,
                .shortened = impl_->shortened,
                .lost = impl_->gateways ? impl_->gateways->lost() : 0};
  impl_->for_each_topic([&](const auto& samples) {
    if (samples) {
      counts.lost += samples->lost();
    }
  });
  return counts;
}

}  // namespace millrace::fabric::observer
