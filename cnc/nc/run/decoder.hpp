// The first stage: reads the program operation by operation, computes, and fills the queue for the
// interpolator. It waits (for a variable, for room, for the interpolator) by trying the same
// operation again in the next tick.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "cnc/nc/run/decoder_state.hpp"
#include "cnc/nc/run/tick.hpp"

namespace millrace::cnc::nc::run {

class Decoder {
 public:
  /// A program or subprogram of the name `stream_name`, if it is not empty, is read from the
  /// stream.
  Decoder(Surroundings surroundings, std::string stream_name, bool flush_continue_waits,
          Duration cycle)
      : state_{surroundings, {},    std::move(stream_name), {},   {}, 0, {}, {},
               false,        false, flush_continue_waits,   cycle} {}

  /// How a program is run.
  struct Run {
    /// Blocks marked with /n are skipped if bit n-1 is set.
    std::uint16_t skipped_levels = 0;
    /// Block search: nothing moves before the first block of this number.
    std::optional<long> search;
  };
  void start(std::shared_ptr<const syntax::Program> program, const Run& run);
  /// The main program comes from the stream.
  void start_stream(const Run& run);
  void stop() { state_.frames.clear(); }
  /// A program is being decoded.
  [[nodiscard]] bool running() const { return !state_.frames.empty(); }
  /// It has not reached the block that is searched for.
  [[nodiscard]] bool searching() const { return running() && state_.search.has_value(); }
  /// Where the decoder is.
  [[nodiscard]] Place place() const { return state_.place(); }
  /// The fault that ended the program does not go away with a reset.
  [[nodiscard]] bool restart_needed() const { return state_.restart_needed; }

  /// Decodes until it must wait or has done `budget` operations; gives what is left of it. A fault
  /// aborts the program; its place is `place`.
  values::Result<std::size_t> run(std::size_t budget, const Tick& tick);

 private:
  void start(Frame main, const Run& run);
  [[nodiscard]] bool skips(const syntax::Operation& operation) const;
  /// The routine in hand has no more blocks.
  values::Result<bool> reach_end(const Tick& tick);
  values::Result<bool> read_stream();
  /// True if the decoder may go on, false if it must wait for the next tick.
  values::Result<bool> step(const Tick& tick);

  DecoderState state_;
  std::uint16_t skipped_levels_ = 0;
};

}  // namespace millrace::cnc::nc::run
