#include "tests/bench/gateway/peers.hpp"

#include <chrono>
#include <memory>
#include <thread>

#include <fmt/format.h>
#include <raw_message.h>
#include <unistd.h>

#include "base/program/log.hpp"
#include "fabric/wire/reader.hpp"
#include "services/sdk/service.hpp"
#include "services/sdk/shared_participant.hpp"
#include "tests/bench/gateway/raw_dds.hpp"

namespace millrace::bench {

namespace {

struct RawEcho {
  dds_entity_t writer = 0;

  static void on_data(dds_entity_t reader, void* self) {
    const auto& echo = *static_cast<const RawEcho*>(self);
    while (fabric::wire::take_lent<bench_RawMessage>(
               reader, [&](const auto& request, const dds_sample_info_t& info) {
                 if (info.valid_data) {
                   dds_write(echo.writer, &request);
                 }
               }) > 0) {
    }
  }
};

}  // namespace

std::vector<std::string> numbered_uuids(std::uint32_t count) {
  std::vector<std::string> uuids;
  for (std::uint32_t number = 0; number < count; ++number) {
    uuids.push_back(fmt::format("be4c4000-0000-4000-8001-{:012x}", number));
  }
  return uuids;
}

std::string dds_configuration(const std::string& interface) {
  return interface.empty()
             ? std::string()
             : fmt::format(
                   R"(<General><Interfaces><NetworkInterface name="{}"/></Interfaces></General>)",
                   interface);
}

std::vector<std::string> peer_arguments(const PeerOptions& options) {
  std::vector<std::string> arguments{"--peer",        options.kind,
                                     "--domain",      std::to_string(options.domain),
                                     "--number",      std::to_string(options.number),
                                     "--count",       std::to_string(options.count),
                                     "--concurrency", std::to_string(options.concurrency),
                                     "--channels",    std::to_string(options.channels),
                                     "--period",      std::to_string(options.period_ms),
                                     "--port",        std::to_string(options.port),
                                     "--machines",    std::to_string(options.machines),
                                     "--of-uuids",    std::to_string(options.uuids)};
  if (!options.interface.empty()) {
    arguments.insert(arguments.end(), {"--interface", options.interface});
  }
  return arguments;
}

tests::Process launch_peer(const PeerOptions& options) {
  std::vector<std::string> command = peer_arguments(options);
  command.insert(command.begin(), "/proc/self/exe");
  return tests::Process(std::move(command));
}

tests::Process start_peer(const PeerOptions& options) {
  tests::Process peer = launch_peer(options);
  peer.await("^ready");
  return peer;
}

tests::Process start_service(std::uint32_t domain, std::uint32_t concurrency,
                             const std::string& kind) {
  PeerOptions options;
  options.kind = kind;
  options.domain = domain;
  options.concurrency = concurrency;
  return start_peer(options);
}

void peer_is_ready(const std::string& word) {
  fmt::print("ready {}\n", word);
  std::fflush(stdout);
}

void wait_for_ever() {
  while (true) {
    ::pause();
  }
}

void serve_sdk(const PeerOptions& options) {
  const bool stuck = options.kind == "stuck";
  const bool uuids = options.kind == "uuids";
  // The warning of an inline handler that has lost its place explains a measurement.
  const auto log = base::program::make_log("bench", spdlog::level::warn);
  const auto participant = std::make_shared<services::sdk::SharedParticipant>(
      fabric::dds::ParticipantOptions{.domain = options.domain,
                                      .configuration = dds_configuration(options.interface)},
      log);
  const std::vector<std::string> own = numbered_uuids(uuids ? options.count : 0);
  std::vector<std::unique_ptr<services::sdk::Service>> services;
  for (std::uint32_t number = 0; number < options.count; ++number) {
    services.push_back(std::make_unique<services::sdk::Service>(
        services::sdk::ServiceOptions{.uuid = uuids ? own[number] : bench_uuid,
                                      .name = "bench",
                                      .concurrency = options.concurrency,
                                      .run_inline = uuids || options.kind == "inline",
                                      .participant = participant},
        [stuck](const services::sdk::Call& call) -> services::sdk::Response {
          while (stuck && !call.cancelled()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
          }
          return {.text = call.text()};
        },
        log));
  }
  peer_is_ready();
  wait_for_ever();
}

void serve_raw(const PeerOptions& options) {
  const RawEndpoint end(options.domain);
  std::vector<RawEcho> echoes(options.count);
  for (std::uint32_t i = 0; i < options.count; ++i) {
    const std::string partition = raw_partition(options.number + i);
    echoes[i].writer = end.create_writer(end.replies(), partition);
    const fabric::dds::Listener listener(dds_create_listener(&echoes[i]));
    dds_lset_data_available(listener.get(), &RawEcho::on_data);
    end.create_reader(end.requests(), partition, listener.get());
  }
  peer_is_ready();
  wait_for_ever();
}

}  // namespace millrace::bench
