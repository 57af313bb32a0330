#include "tools/web/live/web.hpp"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/object.hpp>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/loop/loop.hpp"
#include "base/messages/catalogue.hpp"
#include "base/posix/system.hpp"
#include "base/text/ascii.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/participant_identity.hpp"
#include "tools/bus/operator.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/one_call.hpp"
#include "tools/doctor/diagnose.hpp"
#include "tools/doctor/examine.hpp"
#include "tools/print/json.hpp"
#include "tools/web/actions/user_actions.hpp"
#include "tools/web/live/acknowledgement_file.hpp"
#include "tools/web/metrics/metrics.hpp"

namespace millrace::tools::web::live {

namespace {

// Resource use of this process.

double seconds_of(const timeval& time) {
  constexpr double per_second = 1e6;
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / per_second;
}

/// Each stays nothing where the system does not report it.
void put_process_use(metrics::ProgramFigures& use) {
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0) {
    use.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  }
  // proc(5): total size in pages, then resident size.
  std::ifstream statm("/proc/self/statm");
  double all = 0;
  double resident = 0;
  if (statm >> all >> resident) {
    use.resident_bytes = resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
  }
  std::error_code error;
  const std::filesystem::directory_iterator files("/proc/self/fd", error);
  if (!error) {
    use.open_files = static_cast<double>(std::distance(begin(files), end(files)));
  }
}

// The present findings of `millrace doctor`. An examination joins the fabric for some seconds;
// readers who ask in that time share it.

/// Not thread-safe.
class Examiner {
 public:
  /// A report is used again for so long.
  static constexpr std::chrono::seconds fresh{10};

  explicit Examiner(doctor::Examination examination) : examination_(std::move(examination)) {}

  /// As `doctor --json`, with the time of the examination; blocks for its length. `lost`: machines
  /// whose gateways the server knows to be gone.
  boost::json::object report(std::vector<fabric::plant::LostMachine> lost) {
    if (!examined_ || std::chrono::steady_clock::now() - *examined_ > fresh) {
      examination_.lost = std::move(lost);
      const doctor::Findings found = doctor::examine(examination_);
      last_ = doctor::json_of(found, doctor::diagnose(found));
      print::put_time(last_, "time", std::chrono::system_clock::now());
      examined_ = std::chrono::steady_clock::now();
    }
    return last_;
  }

 private:
  doctor::Examination examination_;
  std::optional<std::chrono::steady_clock::time_point> examined_;
  boost::json::object last_;
};

/// How often samples are processed: a wake-up for each would cost more than the sample. Shorter
/// than what the observer takes for a stall of this process
/// (fabric/endpoints/liveness_monitor.cpp).
constexpr auto turn = std::chrono::milliseconds(25);
/// How many turns from one message for browsers to the next.
constexpr int turns_per_tick = 10;
/// How many turns from one look for other fabrics to the next, while this one has no gateway.
constexpr int turns_per_look = 8 * turns_per_tick;
/// For the outcome of a command.
constexpr auto patience_for_a_word = std::chrono::seconds(2);
/// For browsers to read the last event.
constexpr auto goodbye = std::chrono::milliseconds(200);

fabric::Moment now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

/// Browsers send host names in small letters.
std::set<std::string> names_of(const WebOptions& options) {
  std::set<std::string> names{base::text::small_letters(base::posix::host_name())};
  for (const std::string& name : options.names) {
    names.insert(base::text::small_letters(name));
  }
  return names;
}

struct Web : fabric::observer::ObserverListener {
  Web(WebOptions wanted, base::program::Log destination);
  ~Web() override;

  void on_entry(recording::Entry entry) override { metrics.add(entry, plant.add(entry, now())); }
  void on_ignored(const std::string& reason) override { log->warn("{}", reason); }
  std::optional<actions::UserActions> make_user_actions();
  void load_acknowledgements();
  void run();
  void await_hangup();
  void schedule_turn();
  void process_samples();
  void publish_changes();
  void send_close();
  /// Others see when it is gone without a word.
  [[nodiscard]] bool may_act() const;
  void raise(const fabric::Alarm& alarm);
  void show_that_it_runs();
  [[nodiscard]] std::string metrics_text() const;
  std::optional<fabric::Outcome> issue(const fabric::Command& command);
  boost::json::object call(const actions::ServiceCall& wanted);

  WebOptions options;
  base::program::Log log;
  boost::asio::io_context io{1};
  /// The observer's loop. It runs in turns, so that samples do not wake this process.
  boost::asio::io_context samples{1};
  /// Before everything else that needs descriptors: Cyclone's select() supports 1024.
  fabric::dds::Participant participant;
  fabric::Time started = std::chrono::system_clock::now();
  plant::PlantModel plant;
  metrics::Metrics metrics;
  http::Pages pages;
  std::shared_ptr<http::Recordings> recordings;
  std::shared_ptr<Examiner> examiner;
  std::optional<AcknowledgementFile> acknowledgements;
  std::optional<actions::UserActions> user_actions;
  http::Site site;
  Server server;
  const base::loop::Watchdog watchdog{io.get_executor()};
  boost::asio::steady_timer timer{io};
  int turns = 0;
  const boost::asio::executor_work_guard<boost::asio::io_context::executor_type> more_samples{
      samples.get_executor()};
  boost::asio::signal_set signals{io, SIGINT, SIGTERM};
  boost::asio::signal_set hangup{io, SIGHUP};
  fabric::observer::Observer observer;
  fabric::endpoints::AlarmEndpoint alarms;
};

Web::Web(WebOptions wanted, base::program::Log destination)
    : options(std::move(wanted)),
      log(std::move(destination)),
      participant(options.join),
      plant({.version = options.version,
             .host = base::posix::host_name(),
             .fabric = options.join.fabric,
             .domain = options.join.domain,
             .flags = options.joining.flags,
             .started = started,
             .recordings = !options.recordings.empty(),
             .actions = !options.users.empty()},
            options.normal_states),
      recordings(options.recordings.empty() ? nullptr
                                            : std::make_shared<http::Recordings>(
                                                  options.recordings, options.normal_states)),
      examiner(std::make_shared<Examiner>(
          doctor::Examination{.join = options.join, .joining = options.joining})),
      user_actions(make_user_actions()),
      site({.plant = plant,
            .pages = pages,
            .recordings = recordings,
            .login_for_recordings = options.login_for_recordings,
            .metrics = [this] { return metrics_text(); },
            .doctor = [this]() -> std::function<boost::json::object()> {
              return [examiner = examiner, lost = plant.live().lost()] {
                return examiner->report(lost);
              };
            },
            .action_handler = user_actions ? &*user_actions : nullptr,
            .names = names_of(options)}),
      server(io.get_executor(), options.server, site, log),
      observer(participant, samples.get_executor(), *this, fabric::observer::Interest::everything),
      alarms(participant, io.get_executor(),
             {.key = {.responder = fabric::InstanceId::random()},
              .program = "millrace web",
              .host = base::posix::host_name(),
              .pid = static_cast<std::uint32_t>(::getpid())}) {
  load_acknowledgements();
  server.on_greeting(
      [this] { return event_text("snapshot", print::json_text(plant.greeting(now()))); });
}

std::optional<actions::UserActions> Web::make_user_actions() {
  if (options.users.empty()) {
    return std::nullopt;
  }
  const bool secure = !options.server.certificate.empty() || options.behind_proxy;
  return std::optional<actions::UserActions>(
      std::in_place,
      actions::UserActionsOptions{
          .users = options.users,
          .host = base::posix::host_name(),
          .secure_cookie = secure,
          .call = [this](const actions::ServiceCall& wanted) { return call(wanted); },
          .forget =
              [this](const std::vector<std::string>& machines, const std::string& user,
                     const fabric::Moment& at) { return plant.forget(machines, user, at.wall); }},
      [this](const fabric::Command& command) { return issue(command); },
      [this](plant::Acknowledgement acknowledgement, const fabric::Moment& at) {
        // The page has named it in the language of its user.
        if (fabric::Message subject = plant.subject_of(acknowledgement.cause, at);
            !subject.empty()) {
          acknowledgement.name = std::move(subject);
        }
        plant.acknowledge(std::move(acknowledgement), at.wall);
        if (acknowledgements) {
          acknowledgements->store(plant.acknowledged());
        }
      },
      actions::draw_secret, log);
}

void Web::load_acknowledgements() {
  if (options.state_folder.empty()) {
    return;
  }
  acknowledgements.emplace(options.state_folder, log);
  for (auto& [acknowledgement, at] : acknowledgements->load()) {
    plant.acknowledge(std::move(acknowledgement), at);
  }
}

/// In the operators' thread: threads may share a DDS participant.
std::optional<fabric::Outcome> Web::issue(const fabric::Command& command) {
  const auto outcomes =
      bus::issue(participant, {command}, patience_for_a_word, options.joining.flags);
  const auto word = outcomes.find(command.id);
  return word == outcomes.end() ? std::nullopt : std::optional(word->second.outcome);
}

/// In one of the threads for calls; likewise. It acts as no machine of the plant: that would
/// disturb the machine's own calls.
boost::json::object Web::call(const actions::ServiceCall& wanted) {
  const caller::Slot slot("call", participant.options());
  caller::Order order{.key = {slot.machine(), wanted.channel},
                      .uuid = wanted.uuid,
                      .text = wanted.text,
                      .state = wanted.state,
                      .patience = wanted.patience};
  if (!wanted.machine.empty()) {
    order.as = fabric::ChannelKey{wanted.machine, wanted.channel};
  }
  return caller::json_of(order, caller::OneCall(participant, slot, order).run());
}

std::string Web::metrics_text() const {
  const ServerCounts counts = server.counts();
  metrics::ProgramFigures figures{.version = options.version,
                                  .started = started,
                                  .bus = observer.counts(),
                                  .connections = counts.connections,
                                  .browsers = counts.browsers,
                                  .requests = counts.requests,
                                  .displaced = counts.displaced,
                                  .dropped = counts.dropped,
                                  .certificate_ends = server.certificate_ends()};
  put_process_use(figures);
  return metrics.text(plant, figures, now());
}

Web::~Web() {
  if (recordings) {
    recordings->stop();
  }
}

void Web::run() {
  signals.async_wait([this](const boost::system::error_code&, int) { send_close(); });
  await_hangup();
  schedule_turn();
  io.run();
}

/// With trust, gateways and instances carry out the commands of operators only.
bool Web::may_act() const {
  if (!options.join.trust) {
    return true;
  }
  const auto identity = fabric::parse_participant_identity(options.join.fabric,
                                                           options.join.trust->identity_partitions);
  return identity && identity->roles.contains("operator");
}

void Web::raise(const fabric::Alarm& alarm) {
  if (const auto published = alarms.raise(alarm); !published) {
    log->warn("the alarms of this server cannot be published: {}", published.error());
  }
}

void Web::show_that_it_runs() {
  if (user_actions && !may_act()) {
    const fabric::Message text = base::messages::page_cannot_act(options.join.trust->name);
    const fabric::Message advice = base::messages::issue_operator();
    log->warn("{}: {}", text.text, advice.text);
    raise({.key = {.kind = "actions"},
           .level = fabric::AlarmLevel::warning,
           .text = text,
           .advice = advice});
  }
  raise({.key = {.kind = "page"},
         .level = fabric::AlarmLevel::fine,
         .text = base::messages::serves_page(
             fmt::format("{}:{}", options.server.address, server.port()))});
}

void Web::await_hangup() {
  hangup.async_wait([this](const boost::system::error_code& error, int) {
    if (error) {
      return;
    }
    if (const auto taken = server.take_certificate()) {
      log->info("{}", *taken);
    } else {
      log->error("{}; the one before stays", taken.error());
    }
    await_hangup();
  });
}

void Web::schedule_turn() {
  timer.expires_after(turn);
  timer.async_wait([this](const boost::system::error_code& error) {
    if (error) {
      return;
    }
    process_samples();
    if (++turns % turns_per_tick == 0) {
      publish_changes();
    }
    schedule_turn();
  });
}

/// For one turn at most, so that browsers are served during a flood.
void Web::process_samples() {
  const auto until = std::chrono::steady_clock::now() + turn;
  while (samples.poll_one() > 0 && std::chrono::steady_clock::now() < until) {
  }
}

void Web::publish_changes() {
  plant.set_counts(observer.counts());
  if (turns % turns_per_look == 0 && !plant.live().has_gateway()) {
    plant.set_other_fabrics(bus::other_fabrics(participant));
  }
  if (const auto changes = plant.changes(now())) {
    server.publish("changes", print::json_text(*changes));
  }
}

void Web::send_close() {
  server.publish("bye", R"({"reason":"millrace web ends"})");
  timer.expires_after(goodbye);
  timer.async_wait([this](const boost::system::error_code&) { io.stop(); });
}

}  // namespace

void serve(WebOptions options, base::program::Log log,
           const std::function<void(std::uint16_t port)>& ready) {
  Web web(std::move(options), std::move(log));
  web.show_that_it_runs();
  ready(web.server.port());
  web.run();
}

}  // namespace millrace::tools::web::live
