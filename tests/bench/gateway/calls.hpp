// The cost of a call, compared with the same without a gateway in between. False if a goal is
// missed.
#pragma once

namespace millrace::bench {

/// One at a time, from acceptance to reply, against raw Cyclone, gRPC and LCM.
bool measure_call();
/// 256 channels and 4 instances, against raw Cyclone.
bool measure_throughput();
/// Processor time with 1,000 channels, against one.
bool measure_cost();

}  // namespace millrace::bench
