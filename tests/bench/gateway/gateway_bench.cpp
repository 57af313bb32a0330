// The cost of the gateway, compared with its peers in the same run.
//
//   gateway_bench call         accept -> reply, against raw Cyclone, NATS, gRPC and LCM
//   gateway_bench throughput   256 channels, 4 instances, against raw Cyclone
//   gateway_bench cost         processor time of a call with 1,000 channels, against one
//   gateway_bench program      a call from an NC program, against a polling service
//   gateway_bench load         ADS requests per second, against polling services
//   gateway_bench idle         memory with 1,000 channels, processor time of 10 idle ones
//   gateway_bench secure       Secure ADS against plain ADS: reads, calls, handshakes, memory
//   gateway_bench takeover     kill -9 of an instance until its call runs on another
//   gateway_bench alarm [SECONDS]   instances lost by mistake while both cores are loaded
//   gateway_bench scaling      1, 4, 16 and 64 instances of one UUID, against raw Cyclone
//   gateway_bench presence     10 to 200 idle service processes, against raw Cyclone
//   gateway_bench presence --uuids 1000   one process with this many UUIDs
//   gateway_bench scale        instances, UUIDs, channels, machines, gateways, observers and hosts
//                              each grown alone; hosts need root (network namespaces)
//
// Exit code 1 if a goal is missed. Results of a run: docs/dev/measurements.
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/gateway/rows.hpp"

namespace millrace::bench {

#ifndef MILLRACE_BENCH_GRPC
std::optional<Series> measure_grpc(std::size_t, std::size_t) {
  return std::nullopt;
}
void serve_grpc(const PeerOptions&) {}
#endif
#ifndef MILLRACE_BENCH_LCM
std::optional<Series> measure_lcm(std::size_t, std::size_t) {
  return std::nullopt;
}
void serve_lcm(const PeerOptions&) {}
#endif
#ifndef MILLRACE_BENCH_NATS
std::optional<NatsResult> measure_nats(const NatsLoad&) {
  return std::nullopt;
}
void serve_nats(const PeerOptions&) {}
#endif

namespace {

void serve_peer(const PeerOptions& options) {
  if (options.kind == "raw") {
    serve_raw(options);
  } else if (options.kind == "polling") {
    serve_polling(options);
  } else if (options.kind == "grpc") {
    serve_grpc(options);
  } else if (options.kind == "gateway") {
    serve_gateway(options);
  } else if (options.kind == "lcm") {
    serve_lcm(options);
  } else if (options.kind == "udp") {
    serve_udp(options);
  } else if (options.kind == "nats") {
    serve_nats(options);
  } else {
    serve_sdk(options);
  }
}

int run(int argc, char** argv) {
  CLI::App app{"Measures the gateway and its peers."};
  std::string what;
  std::uint32_t seconds = 60;
  std::vector<std::uint32_t> instances;
  ScalingOptions scaling;
  PresenceOptions presence;
  ScaleOptions scale;
  bool row = false;
  PeerOptions peer;
  app.add_option("what", what,
                 "call, throughput, cost, program, load, idle, secure, takeover, alarm, scaling, "
                 "presence or scale");
  app.add_option("seconds", seconds, "of alarm");
  app.add_option("--instances", instances, "scaling, presence: one row for each number, N,N,…")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  app.add_option("--processes", scaling.processes,
                 "scaling: processes that share the instances of a row")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--rounds", scaling.rounds, "scaling: rounds of each row")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  std::uint32_t idle_seconds = 0;
  app.add_option("--idle", idle_seconds,
                 "presence, scale: seconds of each row without a call (default 24 and 8)")
      ->check(CLI::Range(1, 3600));
  app.add_option("--uuids", presence.uuids, "presence: one process with this many UUIDs instead")
      ->check(CLI::Range(1, 100'000));
  app.add_flag("--no-raw", presence.without_raw, "presence: leave raw Cyclone out");
  app.add_option("--of", scale.of, "scale: the growing dimensions, WORD,WORD,… (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(dimensions()));
  app.add_option("--sizes", scale.sizes, "scale: one row for each, N,N,…")->delimiter(',');
  app.add_flag("--row", row)->group("");
  app.add_option("--peer", peer.kind)->group("");
  app.add_option("--domain", peer.domain)->group("");
  app.add_option("--number", peer.number)->group("");
  app.add_option("--count", peer.count)->group("");
  app.add_option("--concurrency", peer.concurrency)->group("");
  app.add_option("--channels", peer.channels)->group("");
  app.add_option("--period", peer.period_ms)->group("");
  app.add_option("--port", peer.port)->group("");
  app.add_option("--machines", peer.machines)->group("");
  app.add_option("--of-uuids", peer.uuids)->group("");
  app.add_option("--interface", peer.interface)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!peer.kind.empty()) {
    try {
      serve_peer(peer);
      return 0;
    } catch (const std::exception& error) {
      remark(error.what());
      return 1;
    }
  }
  if (idle_seconds != 0) {
    presence.idle_seconds = idle_seconds;
    scale.idle_seconds = idle_seconds;
  }
  if (!instances.empty()) {
    scaling.instances = instances;
    presence.instances = instances;
  }
  if (row) {
    try {
      what == "scaling" ? measure_scaling_row(scaling)
      : what == "scale" ? measure_scale_row(scale)
                        : measure_presence_row(presence);
      return 0;
    } catch (const std::exception& error) {
      remark(error.what());
      return 1;
    }
  }
  const std::map<std::string, std::function<bool()>> measurements{
      {"call", measure_call},
      {"throughput", measure_throughput},
      {"cost", measure_cost},
      {"program", measure_program},
      {"load", measure_controller_load},
      {"idle", measure_idle},
      {"secure",
       [] {
         const bool links = measure_secure_links();
         return measure_secure_gateway() && links;
       }},
      {"takeover", measure_takeover},
      {"alarm", [&] { return measure_alarms(std::chrono::seconds(seconds)); }},
      {"scaling", [&] { return measure_scaling(scaling); }},
      {"presence", [&] { return measure_presence(presence); }},
      {"scale", [&] { return measure_scale(scale); }}};
  const auto found = measurements.find(what);
  if (found == measurements.end()) {
    fmt::print(stderr, "{}", app.help());
    return 2;
  }
  return found->second() ? 0 : 1;
}

}  // namespace

}  // namespace millrace::bench

int main(int argc, char** argv) {
  return millrace::bench::run(argc, argv);
}
