// What gateway_bench measures, one section for each source file of that name.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace millrace::bench {

// The cost of a call, compared with the same without a gateway in between. False if a goal is
// missed.

/// One at a time, from acceptance to reply, against raw Cyclone, gRPC and LCM.
bool measure_call();
/// 256 channels and 4 instances, against raw Cyclone.
bool measure_throughput();
/// Processor time with 1,000 channels, against one.
bool measure_cost();

// Lost instances: how soon their calls run elsewhere, and whether a running one is regarded as
// lost. False if a goal is missed.

/// kill -9 of an instance until its call is dispatched to another.
bool measure_takeover();
/// Instances regarded as lost by mistake during this time, while both cores are loaded.
bool measure_alarms(std::chrono::seconds time);

// Measurements with a virtual CNC over ADS: durations for a program, load of a controller,
// resources of a gateway process.

/// From REQUEST_STATE to RESPONSE_STATE in the program, through the gateway and with a service of
/// the vendor's design at the same period. True if the goal is met.
bool measure_program();
/// ADS requests per second for 20 services on 10 channels. True if the goal is met.
bool measure_controller_load();
/// Memory with 1,000 channels, processor time with 10 channels every 4 ms.
bool measure_idle();
/// A call, and the memory of a machine, with Secure ADS against plain ADS. True if the goals are
/// met.
bool measure_secure_gateway();
/// Calls per second of a virtual CNC with `channels` channels through the gateway; no goal.
void measure_over_ads(std::size_t channels);

// The cost of Secure ADS compared with plain ADS: for a connection alone, and for a gateway.

/// Reads per second, and the time to connect. True if the goals are met.
bool measure_secure_links();

// The cost of idle instances: processes of one UUID and a gateway on one host, compared with as
// many raw Cyclone peers.

struct PresenceOptions {
  /// Service processes of each row.
  std::vector<std::uint32_t> instances{10, 30, 50, 100, 200};
  /// How long their processor time is measured. A participant announces itself every 8 s if its
  /// lease is 10 s, every 24 s if it is 30 s. The time covers whole rounds, because they are most
  /// of the work.
  std::uint32_t idle_seconds = 24;
  /// If not 0, the measurement is a different one: one process with this many UUIDs.
  std::uint32_t uuids = 0;
  /// Two hundred raw processes use both cores for minutes.
  bool without_raw = false;
};

/// All rows, each in its own process. True if the goals are met.
bool measure_presence(const PresenceOptions& options);
/// One row: of the first number of instances, or of the UUIDs.
void measure_presence_row(const PresenceOptions& options);

// The effect of more instances of one UUID on its calls, compared with raw Cyclone with as many
// peers.

struct ScalingOptions {
  std::vector<std::uint32_t> instances{1, 4, 16, 64};
  /// The instances of a row are spread over at most this many processes, and the raw peers too.
  std::uint32_t processes = 4;
  /// Rounds of each row, in turns with raw Cyclone; the best one counts.
  std::uint32_t rounds = 3;
};

/// All rows, each in its own process. True if the goals are met.
bool measure_scaling(const ScalingOptions& options);
/// One row: of the first number of instances.
void measure_scaling_row(const ScalingOptions& options);

// Scaling limits: one dimension of a plant grows alone, one row for each size, until the first
// bottleneck.

struct ScaleOptions {
  /// The dimensions that grow: names of dimensions(); empty: each of them in turn.
  std::vector<std::string> of;
  /// Its sizes; empty: those of the dimension.
  std::vector<std::uint32_t> sizes;
  /// How long the processor time without calls is measured. Participants announce themselves every
  /// 8 s.
  std::uint32_t idle_seconds = 8;
};

/// The names of all dimensions.
std::vector<std::string> dimensions();
/// All rows, each in its own process. True if each of them finished.
bool measure_scale(const ScaleOptions& options);
/// The row of the first size of the first dimension.
void measure_scale_row(const ScaleOptions& options);

}  // namespace millrace::bench
