// millrace-archiver: stores what NC programs send, and what happens on the fabric.
#include <filesystem>
#include <optional>
#include <string_view>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>

#include "base/program/version.hpp"
#include "fabric/observer/observer.hpp"
#include "services/archiver/answering.hpp"
#include "services/archiver/config.hpp"
#include "services/archiver/query.hpp"
#include "services/archiver/writer.hpp"
#include "services/sdk/command_line.hpp"

namespace {

using namespace millrace;
namespace sdk = services::sdk;
namespace archiver = services::archiver;

/// Records what an observer of the fabric sees, as it arrives: events of calls, states of channels,
/// values of machines and events of NC programs. It has its own thread, so that no writer on the
/// fabric waits for the archive.
class ObserverThread final : public fabric::observer::ObserverListener {
 public:
  /// `writer` must outlive it. Throws std::runtime_error if joining the fabric fails.
  ObserverThread(const fabric::dds::ParticipantOptions& join, archiver::Config config,
                 archiver::Writer& writer)
      : config_(std::move(config)), writer_(writer), participant_(join) {
    using fabric::observer::Interest;
    if (config_.record_events || config_.record_channels) {
      calls_.emplace(participant_, context_.get_executor(), *this, Interest::calls);
    }
    if (config_.record_data || config_.record_programs) {
      data_.emplace(participant_, context_.get_executor(), *this, Interest::data);
    }
    thread_ = std::thread([this] { context_.run(); });
  }

  ~ObserverThread() override {
    context_.stop();
    thread_.join();
  }

 private:
  void on_entry(fabric::observer::Entry entry) override {
    if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      const bool secret = config_.without_text.contains(entry.uuid);
      record(config_.record_events,
             archiver::EventRow{.event = std::move(*event), .with_text = !secret});
    } else if (auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
      record(config_.record_channels, std::move(*status));
    } else if (auto* sample = std::get_if<fabric::DataSample>(&entry.sample)) {
      record(config_.record_data, std::move(*sample));
    } else if (auto* ran = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
      record(config_.record_programs, std::move(*ran));
    }
  }

  void record(bool wanted, archiver::Row row) {
    if (wanted) {
      writer_.record(std::move(row));
    }
  }

  archiver::Config config_;
  archiver::Writer& writer_;
  fabric::dds::Participant participant_;
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      context_.get_executor()};
  std::optional<fabric::observer::Observer> calls_;
  std::optional<fabric::observer::Observer> data_;
  std::thread thread_;
};

archiver::Config configuration(const std::string& file) {
  return file.empty() ? archiver::default_config(std::filesystem::current_path())
                      : base::program::must(archiver::load(file));
}

/// Responds once the row is on the disk; the SDK's threads do not wait for that.
sdk::AsyncHandler writing_to(archiver::Writer& writer) {
  return [&writer](const std::shared_ptr<const sdk::Call>& call) {
    auto put = archiver::put_of(call->request(), std::chrono::system_clock::now());
    if (!put) {
      call->answer(put.error());
      return;
    }
    writer.put(*std::move(put), [call](const archiver::Written& written) {
      call->answer(archiver::answer_to(written));
    });
  };
}

int serve(int argc, char** argv) {
  // A repeated call adds no second row, so delivery is at least once.
  sdk::ServiceProgram program({.uuid = "326de49a-633b-4cea-a9b8-1924d7f926a7",
                               .name = "archiver",
                               .description = "Archives data from NC programs and the events of "
                                              "the fabric. See also: query --help, export --help",
                               .version = base::program::version(),
                               .delivery = fabric::Delivery::at_least_once,
                               .concurrency = 16});
  std::string file;
  program.app().add_option("--config", file, "Settings (archiver.textproto)")->type_name("FILE");
  base::program::add_check(program.app());
  std::optional<archiver::Writer> writer;
  std::optional<ObserverThread> observer;
  const std::function<sdk::AsyncHandler()> make = [&] {
    const archiver::Config config = configuration(file);
    const auto report = [log = program.log()](const std::string& news) { log->error("{}", news); };
    writer.emplace(
        archiver::Archive(config.folder, config.policy, std::chrono::system_clock::now(), report),
        program.log(), program.alarms());
    if (config.record_events || config.record_channels || config.record_data ||
        config.record_programs) {
      observer.emplace(program.join_as("archiver observer"), config, *writer);
    }
    return writing_to(*writer);
  };
  return program.run(argc, argv, make);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "query") {
    return archiver::query(argc - 1, argv + 1);
  }
  if (command == "export") {
    return archiver::export_rows(argc - 1, argv + 1);
  }
  if (base::program::asks_for_check(argc, argv)) {
    return base::program::check(argc, argv, [](const std::string& file) {
      return "the archive is " + configuration(file).folder.string();
    });
  }
  return serve(argc, argv);
}
