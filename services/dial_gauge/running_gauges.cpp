#include "services/dial_gauge/running_gauges.hpp"

#include <bit>
#include <mutex>
#include <thread>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "base/program/command_line.hpp"
#include "services/dial_gauge/receiver.hpp"
#include "services/dial_gauge/serial_line.hpp"
#include "services/dial_gauge/zeros.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::dial_gauge {

namespace {

Zeros zeros_or_throw(const std::filesystem::path& file) {
  auto zeros = read_zeros(file);
  if (!zeros) {
    throw base::program::UsageError(zeros.error());
  }
  return *std::move(zeros);
}

/// What is heard on one line, into its receiver and the log.
class Listener : public SerialLineListener {
 public:
  Listener(const LineConfig& config, std::mutex& lock, base::program::Log log)
      : name_(config.name),
        lock_(lock),
        log_(std::move(log)),
        receiver_(std::make_shared<Receiver>(config.form, config.unit)) {}

  [[nodiscard]] std::shared_ptr<const Receiver> receiver() const { return receiver_; }

  void on_opened() override {
    log_->info("line {} is open", name_);
    const std::lock_guard guard(lock_);
    receiver_->opened();
  }

  void on_closed(const std::string& reason) override {
    log_->error("line {} is gone and will be opened again: {}", name_, reason);
    const std::lock_guard guard(lock_);
    receiver_->closed(reason);
  }

  void on_bytes(std::string_view bytes) override {
    std::unique_lock guard(lock_);
    const auto broken = receiver_->hear(bytes, Time::clock::now());
    guard.unlock();
    for (const std::string& text : broken) {
      // The 1st, 2nd, 4th, 8th …: a noisy line must not fill the log.
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
  std::shared_ptr<Receiver> receiver_;
  std::uint64_t broken_ = 0;
};

}  // namespace

struct RunningGauges::Impl {
  Impl(const Config& config, const base::program::Log& log)
      : answering(zeros_or_throw(config.zero_file), [file = config.zero_file](const Zeros& zeros) {
          return keep_zeros(file, zeros);
        }) {
    for (const LineConfig& line : config.lines) {
      listeners.push_back(std::make_unique<Listener>(line, lock, log));
      lines.push_back(
          std::make_unique<SerialLine>(context.get_executor(), line, *listeners.back()));
    }
    for (const GaugeConfig& gauge : config.gauges) {
      answering.add(gauge.gauge, source_of(gauge));
    }
    thread = std::thread([this] { context.run(); });
  }

  ~Impl() {
    context.stop();
    thread.join();
  }

  std::unique_ptr<Source> source_of(const GaugeConfig& gauge) {
    if (const auto* radio = std::get_if<RadioConfig>(&gauge.source)) {
      return std::make_unique<RadioSource>(listeners.at(radio->line)->receiver(), radio->channel);
    }
    return std::make_unique<SimulatedSource>(std::get<Simulation>(gauge.source),
                                             Time::clock::now());
  }

  /// For the receivers and what answers.
  std::mutex lock;
  boost::asio::io_context context;
  std::vector<std::unique_ptr<Listener>> listeners;
  std::vector<std::unique_ptr<SerialLine>> lines;
  Answering answering;
  std::thread thread;
};

RunningGauges::RunningGauges(const Config& config, base::program::Log log)
    : impl_(std::make_unique<Impl>(config, log)) {}

RunningGauges::~RunningGauges() = default;

sdk::Response RunningGauges::answer(std::string_view request) {
  const std::lock_guard guard(impl_->lock);
  return impl_->answering.answer(request, Time::clock::now());
}

}  // namespace millrace::services::dial_gauge
