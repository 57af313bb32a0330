// millrace-dial-gauge: reads wireless dial gauges, and simulates them.
#include <bit>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/program/version.hpp"
#include "services/dial_gauge/config.hpp"
#include "services/dial_gauge/receiver.hpp"
#include "services/dial_gauge/serial_line.hpp"
#include "services/sdk/command_line.hpp"

namespace millrace::services::dial_gauge {

namespace {

/// Passes the bytes of one line to its receiver, and its events to the log.
class Listener : public SerialLineListener {
 public:
  Listener(const LineConfig& config, std::mutex& lock, base::program::Log log,
           fabric::AlarmSink& alarms)
      : name_(config.name),
        lock_(lock),
        log_(std::move(log)),
        alarms_(alarms),
        receiver_(std::make_shared<Receiver>(config.form, config.unit)) {}

  [[nodiscard]] std::shared_ptr<const Receiver> receiver() const { return receiver_; }

  void on_opened() override {
    log_->info("line {} is open", name_);
    alarms_.clear("gauge_line", name_);
    const std::lock_guard guard(lock_);
    receiver_->opened();
  }

  void on_closed(const std::string& reason) override {
    log_->error("line {} failed and will be opened again: {}", name_, reason);
    alarms_.raise({.key = {.kind = "gauge_line", .subject = name_},
                   .level = fabric::AlarmLevel::problem,
                   .text = base::messages::gauge_line_failed(name_, reason),
                   .advice = base::messages::check_gauge_line()});
    const std::lock_guard guard(lock_);
    receiver_->closed(reason);
  }

  void on_bytes(std::string_view bytes) override {
    std::unique_lock guard(lock_);
    const auto broken = receiver_->hear(bytes, Time::clock::now());
    guard.unlock();
    for (const std::string& text : broken) {
      // Logs the 1st, 2nd, 4th, 8th …: a noisy line must not fill the log.
      if (std::has_single_bit(++broken_)) {
        log_->warn("line {}: {} broken frames so far, the last {}", name_, broken_,
                   text::in_quotes(text));
      }
    }
  }

 private:
  std::string name_;
  std::mutex& lock_;
  base::program::Log log_;
  fabric::AlarmSink& alarms_;
  std::shared_ptr<Receiver> receiver_;
  std::uint64_t broken_ = 0;
};

/// How often failing gauges are checked.
constexpr std::chrono::seconds pause{1};

/// The running gauges of a configuration: simulators, and receivers on serial lines with a thread
/// that reads them.
class RunningGauges {
 public:
  /// `own_alarms`, which must outlive it, gets the alarms of lines that are down ("gauge_line") and
  /// of gauges whose requested reading failed ("gauge"). Throws program::UsageError for a file of
  /// zero points that cannot be read.
  RunningGauges(const Config& config, const base::program::Log& log, fabric::AlarmSink& own_alarms)
      : alarms(own_alarms),
        answering(
            base::program::must(read_zeros(config.zero_file)),
            [file = config.zero_file](const Zeros& zeros) { return keep_zeros(file, zeros); }) {
    for (const LineConfig& line : config.lines) {
      listeners.push_back(std::make_unique<Listener>(line, lock, log, alarms));
      lines.push_back(
          std::make_unique<SerialLine>(context.get_executor(), line, *listeners.back()));
    }
    for (const GaugeConfig& gauge : config.gauges) {
      answering.add(gauge.gauge, source_of(gauge));
    }
    look_around();
    thread = std::thread([this] { context.run(); });
  }

  ~RunningGauges() {
    context.stop();
    thread.join();
  }

  /// From any thread.
  sdk::Response answer(std::string_view request) {
    const std::lock_guard guard(lock);
    sdk::Response response = answering.answer(request, Time::clock::now());
    report_failing();
    return response;
  }

 private:
  void look_around() {
    timer.expires_after(pause);
    timer.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        const std::lock_guard guard(lock);
        answering.look();
        report_failing();
        look_around();
      }
    });
  }

  /// Needs the lock.
  void report_failing() {
    for (const auto& [gauge, why] : answering.failing()) {
      alarms.raise({.key = {.kind = "gauge", .subject = gauge},
                    .level = fabric::AlarmLevel::problem,
                    .text = base::messages::gauge_unreadable(why),
                    .advice = base::messages::check_gauge()});
    }
    for (const auto& [gauge, why] : reported) {
      if (!answering.failing().contains(gauge)) {
        alarms.clear("gauge", gauge);
      }
    }
    reported = answering.failing();
  }

  std::unique_ptr<Source> source_of(const GaugeConfig& gauge) {
    if (const auto* radio = std::get_if<RadioConfig>(&gauge.source)) {
      return std::make_unique<RadioSource>(listeners.at(radio->line)->receiver(), radio->channel);
    }
    return std::make_unique<SimulatedSource>(std::get<Simulation>(gauge.source),
                                             Time::clock::now());
  }

  /// Protects the receivers and the Answering.
  std::mutex lock;
  fabric::AlarmSink& alarms;
  boost::asio::io_context context;
  boost::asio::steady_timer timer{context};
  std::vector<std::unique_ptr<Listener>> listeners;
  std::vector<std::unique_ptr<SerialLine>> lines;
  Answering answering;
  /// The failing gauges at the last report.
  std::map<std::string, std::string> reported;
  std::thread thread;
};

Config configuration(const std::string& file) {
  return file.empty() ? demonstration(std::filesystem::current_path())
                      : base::program::must(load(file));
}

int run(int argc, char** argv) {
  if (base::program::asks_for_check(argc, argv)) {
    return base::program::check(argc, argv, [](const std::string& file) {
      const Config config = configuration(file);
      return fmt::format("{} gauges, {} lines", config.gauges.size(), config.lines.size());
    });
  }
  // At most once: a repeated ZERO may set another zero point.
  sdk::ServiceProgram program({.uuid = "e6f15204-3a7c-4686-9bc3-1400d062127c",
                               .name = "dial_gauge",
                               .description = "Answers with the values of dial gauges",
                               .version = base::program::version(),
                               .delivery = fabric::Delivery::at_most_once});
  std::string file;
  program.app()
      .add_option("--config", file,
                  "Gauges to serve (dial_gauge.textproto). Without it, one simulated gauge "
                  "G1 that shows 12.345 mm")
      ->type_name("FILE");
  base::program::add_check(program.app());
  std::optional<RunningGauges> gauges;
  const std::function<sdk::Handler()> make = [&]() -> sdk::Handler {
    gauges.emplace(configuration(file), program.log(), program.alarms());
    return [&](const sdk::Call& call) { return gauges->answer(call.text()); };
  };
  return program.run(argc, argv, make);
}

}  // namespace
}  // namespace millrace::services::dial_gauge

int main(int argc, char** argv) {
  return millrace::services::dial_gauge::run(argc, argv);
}
