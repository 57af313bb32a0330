// millrace-archiver: stores what NC programs send, and what happens on the fabric.
#include <filesystem>
#include <optional>
#include <string_view>

#include "services/archiver/answering.hpp"
#include "services/archiver/config.hpp"
#include "services/archiver/observer_thread.hpp"
#include "services/archiver/query.hpp"
#include "services/archiver/writer.hpp"
#include "services/sdk/command_line.hpp"

namespace {

using namespace millrace;
namespace sdk = services::sdk;
namespace archiver = services::archiver;

archiver::Config configuration(const std::string& file) {
  if (file.empty()) {
    return archiver::default_config(std::filesystem::current_path());
  }
  auto config = archiver::load(file);
  if (!config) {
    throw base::program::UsageError(config.error());
  }
  return *std::move(config);
}

archiver::CallInfo info(const sdk::Call& call) {
  return {.call = call.id(),
          .key = call.channel(),
          .state = call.state(),
          .request = call.text(),
          .replayed = call.replayed()};
}

/// Responds once the row is on the disk; the SDK's threads do not wait for that.
sdk::AsyncHandler writing_to(archiver::Writer& writer) {
  return [&writer](const std::shared_ptr<const sdk::Call>& call) {
    auto put = archiver::put_of(info(*call), std::chrono::system_clock::now());
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
                               .version = MILLRACE_VERSION,
                               .delivery = fabric::Delivery::at_least_once,
                               .concurrency = 16});
  std::string file;
  program.app().add_option("--config", file, "Settings (archiver.textproto)");
  base::program::add_check(program.app());
  std::optional<archiver::Writer> writer;
  std::optional<archiver::ObserverThread> observer;
  const std::function<sdk::AsyncHandler()> make = [&] {
    const archiver::Config config = configuration(file);
    const auto report = [log = program.log()](const std::string& news) { log->error("{}", news); };
    writer.emplace(
        archiver::Archive(config.folder, config.policy, std::chrono::system_clock::now(), report),
        program.log(), program.alarms());
    if (config.record_events || config.record_channels || config.record_data ||
        config.record_programs) {
      const sdk::ServiceOptions& options = program.options();
      observer.emplace(fabric::dds::ParticipantOptions{.domain = options.domain,
                                                       .fabric = options.fabric,
                                                       .lease = options.lease,
                                                       .name = "archiver observer",
                                                       .configuration = options.configuration,
                                                       .trust = options.trust},
                       archiver::Observed{.events = config.record_events,
                                          .channels = config.record_channels,
                                          .data = config.record_data,
                                          .programs = config.record_programs,
                                          .without_text = config.without_text},
                       [&](archiver::Row row) { writer->record(std::move(row)); });
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
