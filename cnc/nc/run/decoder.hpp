// The first stage: reads the program operation by operation, computes, and fills the queue for the
// interpolator. To wait (for a variable, for room, for the interpolator), it tries the same
// operation again in the next tick.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "cnc/nc/run/block.hpp"
#include "cnc/nc/run/decoder_state.hpp"

namespace millrace::cnc::nc::run {

class Decoder {
 public:
  /// A program or subprogram with the name `stream_name`, if it is not empty, is read from the
  /// stream.
  Decoder(Surroundings surroundings, std::string stream_name, bool flush_continue_waits,
          Duration cycle)
      : state_{surroundings, {},    std::move(stream_name), {},   {}, 0, {}, {}, {},
               false,        false, flush_continue_waits,   cycle} {}

  /// Settings of a program run.
  struct Run {
    /// Blocks marked with /n are skipped if bit n-1 is set.
    std::uint16_t skipped_levels = 0;
    /// Block search: no motion before the first block of this number.
    std::optional<long> search;
  };
  void start(std::shared_ptr<const syntax::Program> program, const Run& run);
  /// Reads the main program from the stream.
  void start_stream(const Run& run);
  void stop() { state_.frames.clear(); }
  /// True while a program is being decoded.
  [[nodiscard]] bool running() const { return !state_.frames.empty(); }
  /// True until the decoder has reached the block of the block search.
  [[nodiscard]] bool searching() const { return running() && state_.search.has_value(); }
  /// The current place of the decoder.
  [[nodiscard]] Place place() const { return state_.place(); }
  /// The fault that ended the program cannot be cleared by a reset.
  [[nodiscard]] bool restart_needed() const { return state_.restart_needed; }

  /// Decodes until it must wait or has executed `budget` operations; returns the rest of the
  /// budget. A fault aborts the program (values::Aborted); its place is place().
  std::size_t run(std::size_t budget, const Tick& tick);

 private:
  void start(Frame main, const Run& run);
  [[nodiscard]] bool skips(const syntax::Operation& operation) const;
  /// The current routine has no further blocks.
  bool reach_end(const Tick& tick);
  bool read_stream();
  /// True if the decoder may continue, false if it must wait for the next tick.
  bool step(const Tick& tick);

  DecoderState state_;
  std::uint16_t skipped_levels_ = 0;
};

}  // namespace millrace::cnc::nc::run
