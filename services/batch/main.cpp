// millrace-batch: programs and scripts as services.
#include <algorithm>
#include <array>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <thread>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/program/command_tree.hpp"
#include "base/program/log.hpp"
#include "base/program/version.hpp"
#include "services/batch/call.hpp"
#include "services/batch/catalog.hpp"
#include "services/batch/config.hpp"
#include "services/sdk/alarms.hpp"
#include "services/sdk/command_line.hpp"
#include "services/sdk/file_changes.hpp"
#include "services/sdk/host_program.hpp"
#include "services/sdk/stop_signals.hpp"

namespace millrace::services::batch {

namespace {

namespace program = base::program;
using Clock = std::chrono::steady_clock;

sdk::Response answer(const Script& script, const sdk::Call& call, spdlog::logger& log) {
  const auto command = command_for(script, call.request());
  if (!command) {
    return command.error();
  }
  const Ended ended = run(*command, limits_for(script), [&] { return call.cancelled(); });
  Verdict result = verdict(script, ended);
  if (!result.remark.empty()) {
    log.warn("call {}: {} {}", call.id().to_string(), script.announcement.name, result.remark);
  }
  return result.answer;
}

/// A script that may be replaced while calls run; each call runs the script that was current when
/// it began.
class CurrentScript {
 public:
  explicit CurrentScript(Script script) : script_(std::move(script)) {}
  [[nodiscard]] Script get() const {
    const std::lock_guard guard(lock_);
    return script_;
  }
  void set(Script script) {
    const std::lock_guard guard(lock_);
    script_ = std::move(script);
  }

 private:
  mutable std::mutex lock_;
  Script script_;
};

/// Runs the script for each call; a cancelled call ends its process.
sdk::Handler answering(std::shared_ptr<const CurrentScript> script, base::program::Log log) {
  return [script = std::move(script), log = std::move(log)](const sdk::Call& call) {
    return answer(script->get(), call, *log);
  };
}

/// The services of a batch configuration on the fabric. Not thread-safe.
class Host {
 public:
  /// `base` has the fabric and the version; each script has the rest. `name` is that of the process
  /// in alarms.
  Host(sdk::ServiceOptions base, const std::string& name, base::program::Log log);
  /// Leaves the fabric after the running calls are answered.
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Serves these scripts, if their files exist, in place of the earlier ones. A removed service
  /// finishes its calls. A script that cannot be registered is logged and left out.
  void serve(const std::vector<Script>& scripts);

  /// Removes services that an operator has drained; true if that were the last ones.
  bool remove_drained();

  [[nodiscard]] std::size_t size() const { return services_.size(); }

 private:
  struct Served {
    Script script;
    std::shared_ptr<CurrentScript> current;
    std::unique_ptr<sdk::Service> service;
  };

  void report_absent(const std::vector<Script>& scripts);
  void start(const Script& script);
  void stop(const std::string& uuid);

  sdk::ServiceOptions base_;
  base::program::Log log_;
  sdk::Alarms alarms_;
  /// Their UUIDs.
  std::set<std::string> absent_;
  std::map<std::string, Served> services_;
  /// Services that finish their calls; each thread ends with its service.
  std::vector<std::jthread> leaving_;
};

Host::Host(sdk::ServiceOptions base, const std::string& name, base::program::Log log)
    : base_(std::move(base)), log_(std::move(log)) {
  alarms_.join(base_.participant, sdk::identity_of_process(name), log_);
}

Host::~Host() {
  alarms_.leave();
  // Stops all at once, then waits for each.
  for (auto& [uuid, served] : services_) {
    served.service->stop();
  }
}

void Host::serve(const std::vector<Script>& scripts) {
  std::vector<Script> before;
  before.reserve(services_.size());
  for (const auto& [uuid, served] : services_) {
    before.push_back(served.script);
  }
  report_absent(scripts);
  const Changes todo = changes(before, present(scripts));
  for (const std::string& uuid : todo.stop) {
    stop(uuid);
  }
  for (const Script& script : todo.start) {
    start(script);
  }
  for (const Script& script : todo.update) {
    Served& served = services_.at(script.announcement.uuid);
    served.script = script;
    served.current->set(script);
    log_->info("{} runs {} with the new configuration from now on", script.announcement.name,
               script.program.string());
  }
}

void Host::report_absent(const std::vector<Script>& scripts) {
  constexpr const char* kind = "script";
  std::set<std::string> absent_now;
  for (const Script& script : absent(scripts)) {
    const std::string& uuid = script.announcement.uuid;
    log_->warn("{}", absence_of(script));
    alarms_.raise({.key = {.kind = kind, .subject = uuid},
                   .level = fabric::AlarmLevel::problem,
                   .text = base::messages::script_unusable(script.program.string(), uuid),
                   .advice = base::messages::restore_script()});
    absent_now.insert(uuid);
  }
  for (const std::string& uuid : absent_) {
    if (!absent_now.contains(uuid)) {
      alarms_.clear(kind, uuid);
    }
  }
  absent_ = std::move(absent_now);
}

void Host::start(const Script& script) {
  const std::string& uuid = script.announcement.uuid;
  const std::string& name = script.announcement.name;
  auto current = std::make_shared<CurrentScript>(script);
  try {
    auto service = std::make_unique<sdk::Service>(sdk::options_of(script.announcement, base_),
                                                  answering(current, log_), log_);
    services_.insert_or_assign(
        uuid,
        Served{.script = script, .current = std::move(current), .service = std::move(service)});
    log_->info("{} serves {} with {}", name, uuid, script.program.string());
  } catch (const std::exception& error) {
    log_->error("{} cannot serve {}: {}", name, uuid, error.what());
  }
}

void Host::stop(const std::string& uuid) {
  auto node = services_.extract(uuid);
  Served& served = node.mapped();
  log_->info("{} has stopped serving {}", served.script.announcement.name, uuid);
  served.service->stop();
  leaving_.emplace_back([service = std::move(served.service)] { service->wait(); });
}

bool Host::remove_drained() {
  const std::size_t left = std::erase_if(services_, [&](const auto& entry) {
    const Served& served = entry.second;
    if (!served.service->drained()) {
      return false;
    }
    log_->info("{} is drained and has stopped serving {}", served.script.announcement.name,
               entry.first);
    served.service->wait();
    return true;
  });
  return left > 0 && services_.empty();
}

/// Time between two checks; short enough to notice that a file is still changing.
std::chrono::milliseconds interval(const Config& config) {
  return std::clamp<std::chrono::milliseconds>(config.settle / 4, std::chrono::milliseconds(20),
                                               std::chrono::seconds(1));
}

/// Serves a batch.textproto and applies its changes, and those of the scripts in it.
class Folder {
 public:
  /// Throws program::UsageError with every mistake of the file.
  Folder(std::filesystem::path file, sdk::ServiceOptions base, const std::string& name,
         program::Log log);

  /// Returns after stop(), or when an operator has drained the last service. A file with a mistake
  /// changes nothing and is logged.
  void follow();
  /// From any thread.
  void stop();

  [[nodiscard]] std::size_t size() const { return host_.size(); }

 private:
  void look();

  std::filesystem::path file_;
  program::Log log_;
  Config config_;
  sdk::Settle settle_;
  Host host_;
  std::mutex lock_;
  std::condition_variable changed_;
  bool stopping_ = false;
};

Folder::Folder(std::filesystem::path file, sdk::ServiceOptions base, const std::string& name,
               program::Log log)
    : file_(std::move(file)),
      log_(log),
      config_(program::must(load(file_))),
      settle_(config_.settle, fingerprint(file_, config_.scripts), Clock::now()),
      host_(std::move(base), name, std::move(log)) {
  host_.serve(config_.scripts);
}

void Folder::follow() {
  std::unique_lock guard(lock_);
  while (!changed_.wait_for(guard, interval(config_), [this] { return stopping_; })) {
    // A check takes time; stop() need not wait for it.
    guard.unlock();
    look();
    const bool all_left = host_.remove_drained();
    guard.lock();
    if (all_left) {
      log_->info("all services are drained: the end");
      return;
    }
  }
}

void Folder::stop() {
  const std::lock_guard guard(lock_);
  stopping_ = true;
  changed_.notify_one();
}

void Folder::look() {
  if (!settle_.look(fingerprint(file_, config_.scripts), Clock::now())) {
    return;
  }
  auto config = load(file_);
  if (!config) {
    log_->error("{}\nThe services are not changed.", config.error());
    return;
  }
  config_ = *std::move(config);
  settle_ = sdk::Settle(config_.settle, fingerprint(file_, config_.scripts), Clock::now());
  host_.serve(config_.scripts);
}

struct Flags {
  std::string program;
  std::uint32_t time_limit_ms = 30000;
  bool accept_empty = false;
  bool cut = false;
  bool cp1252 = false;
};

void add_flags(CLI::App& app, Flags& flags) {
  app.add_option("--exec", flags.program, "Script or executable to run for each call")
      ->type_name("SCRIPT")
      ->required();
  app.add_option("--time-limit", flags.time_limit_ms, "Longest run time in milliseconds")
      ->check(program::positive_number())
      ->capture_default_str();
  app.add_flag("--accept-empty", flags.accept_empty, "Also run it for an empty request");
  app.add_flag("--cut", flags.cut, "Answer with the first 127 bytes of longer output");
  app.add_flag("--cp1252", flags.cp1252, "The script uses the controller's code page, not UTF-8");
}

/// Throws UsageError for a missing file: without --config, no check would notice it later.
Script script_from(const Flags& flags, const sdk::ServiceOptions& options) {
  Script script;
  script.announcement.name = options.name;
  script.program = std::filesystem::absolute(flags.program).lexically_normal();
  script.folder = std::filesystem::current_path();
  script.time_limit = std::chrono::milliseconds(flags.time_limit_ms);
  script.too_long = flags.cut ? TooLong::cut : TooLong::refuse;
  script.encoding = flags.cp1252 ? Encoding::cp1252 : Encoding::utf8;
  script.accept_empty = flags.accept_empty;
  if (present({script}).empty()) {
    throw program::UsageError("--exec: " + script.program.string() +
                              " is missing or not executable");
  }
  return script;
}

sdk::ServiceOptions defaults() {
  return {.name = "batch",
          .description = "Answers calls with a script",
          .version = program::version(),
          .delivery = fabric::Delivery::at_most_once};
}

/// Adds those of its flags that `others` does not have, for their help, man page and completion. A
/// command line with one of them and without --exec is refused.
void tell_flags_of_one(CLI::App& others) {
  sdk::ServiceProgram program(defaults());
  Flags flags;
  add_flags(program.app(), flags);
  for (const program::CommandOption& option : program::command_tree(program.app(), "").options) {
    if (option.names.empty() || others.get_option_no_throw(option.names.front()) != nullptr) {
      continue;
    }
    const std::string name = option.names.front();
    const auto refuse = [name] { throw CLI::ValidationError(name, "needs --exec SCRIPT"); };
    const std::string description = "With --exec: " + option.description;
    CLI::Option* const given =
        option.value.empty()
            ? others.add_flag_callback(name, refuse, description)
            : others
                  .add_option_function<std::string>(
                      name, [refuse](const std::string&) { refuse(); }, description)
                  ->type_name(option.value);
    given->group("One script without a file");
  }
}

/// --exec: one script, configured on the command line. Returns an exit code.
int serve_one(int argc, char** argv) {
  sdk::ServiceProgram program(defaults());
  Flags flags;
  add_flags(program.app(), flags);
  const std::function<sdk::Handler()> make = [&] {
    return answering(std::make_shared<CurrentScript>(script_from(flags, program.options())),
                     program.log());
  };
  return program.run(argc, argv, make);
}

/// --config: many scripts, each with its UUID.
int serve_folder(int argc, char** argv) {
  std::string file = "batch.textproto";
  sdk::HostProgram host("Answers calls with scripts", "batch", [&](CLI::App& app) {
    app.add_option("--config", file, "Services and their scripts; changes are applied at once")
        ->type_name("FILE")
        ->capture_default_str();
  });
  tell_flags_of_one(host.app());
  host.app().footer(
      "One script without a file:\n"
      "  millrace-batch --exec ./measure.sh --uuid 3f0c8a52-7d1e-4b6f-9a35-c2e84d17b690");
  return host.run(argc, argv, [&](const sdk::HostedProcess& process) {
    const sdk::ServiceOptions options = process.services();
    std::optional<Folder> folder;
    sdk::StopSignals signals(process.log);
    folder.emplace(file, options, process.name, process.log);
    signals.on_stop([&] { folder->stop(); });
    program::ready(fmt::format("{} serves {} {} of {} on domain {}", process.name, folder->size(),
                               folder->size() == 1 ? "UUID" : "UUIDs", file, process.join.domain));
    folder->follow();
    return program::exit_done;
  });
}

/// A missing program is no mistake: the service starts without it, and the check may run on
/// another host.
std::string checked(const std::string& file) {
  const std::vector<Script> scripts = program::must(load(file)).scripts;
  const std::size_t count = scripts.size();
  const std::vector<Script> missing = absent(scripts);
  for (const Script& script : missing) {
    fmt::print(stderr, "warning: {}: {}\n", file, absence_of(script));
  }
  return fmt::format("{} {}{}", count, count == 1 ? "script" : "scripts",
                     missing.empty() ? "" : fmt::format(", {} not usable here", missing.size()));
}

/// `millrace-batch outlive PROGRAM [ARGUMENT]…`, for scripts; `argv` begins with "outlive". Returns
/// an exit code.
int start_apart(int argc, char** argv) {
  CLI::App app("Starts a program that outlives the call of the script that uses this command",
               "millrace-batch outlive");
  app.add_option("PROGRAM", "The program and its arguments")->required();
  // The flags behind the program are its own.
  const bool is_help = argc > 1 && std::string_view(argv[1]).starts_with('-');
  return program::run(app, is_help ? argc : std::min(argc, 2), argv, [&] {
    if (const auto started = outlive({argv + 1, argv + argc}); !started) {
      throw std::runtime_error(started.error());
    }
    return program::exit_done;
  });
}

bool is_exec(std::string_view argument) {
  return argument == "--exec" || argument.starts_with("--exec=");
}

bool asks_for_help(std::string_view argument) {
  return argument == "--help" || argument == "-h";
}

}  // namespace

}  // namespace millrace::services::batch

int main(int argc, char** argv) {
  using namespace millrace::services::batch;
  if (argc > 1 && std::string_view(argv[1]) == "outlive") {
    return start_apart(argc - 1, argv + 1);
  }
  if (std::none_of(argv, argv + argc, is_exec)) {
    return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                               : serve_folder(argc, argv);
  }
  // "--exec --help" has no script; it only requests the help.
  char* const* const help = std::find_if(argv, argv + argc, asks_for_help);
  if (help == argv + argc) {
    return serve_one(argc, argv);
  }
  std::array<char*, 3> only_help{argv[0], *help, nullptr};
  return serve_one(2, only_help.data());
}
