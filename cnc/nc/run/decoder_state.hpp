// What the decoder knows while it runs programs: the stack of routines, and what it waits for.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cnc/nc/run/interpolator.hpp"
#include "cnc/nc/run/library.hpp"
#include "cnc/nc/run/macros.hpp"
#include "cnc/nc/run/memory.hpp"
#include "cnc/nc/run/message_box.hpp"
#include "cnc/nc/run/motion.hpp"
#include "cnc/nc/run/queue.hpp"
#include "cnc/nc/run/stream.hpp"
#include "cnc/nc/run/system_variables.hpp"
#include "cnc/nc/syntax/program.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

/// A cycle that is called again behind each block that moves (or behind each block).
struct ModalCycle {
  std::shared_ptr<const syntax::Program> program;
  const syntax::Routine* routine = nullptr;
  CycleArguments arguments;
  syntax::CycleRepeat repeat{};
};

/// A routine in execution.
struct Frame {
  std::shared_ptr<const syntax::Program> program;
  const syntax::Routine* routine = nullptr;
  /// Index of the operation in hand.
  std::size_t position = 0;
  /// N number of the block in hand.
  long block_number = 0;
  std::optional<ModalCycle> modal;
  /// Its blocks come from the stream, packet by packet.
  bool streamed = false;
};

/// A routine that waits for its first packet.
[[nodiscard]] Frame streamed_frame(const std::string& name);

/// The rest of the channel, which outlives the decoder.
struct Surroundings {
  Memory& memory;
  Macros& macros;
  MotionState& motion;
  Queue& queue;
  const Interpolator& interpolator;
  MessageBox& messages;
  Timers& timers;
  Stream& stream;
  const SystemVariables& system;
};

struct DecoderState {
  Surroundings around;
  Library library;
  /// The name that stands for the stream; none if it is empty.
  std::string stream_name;
  /// The main program first; empty if nothing runs.
  std::vector<Frame> frames;
  /// Block search: the number of the block from which on the program is executed, until it is
  /// reached.
  std::optional<long> search;
  /// Blocks read since the program's start, repeated ones each time.
  std::uint64_t blocks_read = 0;
  /// #FILE NAME
  std::string report_file;
  /// A #MSG ACK in hand waits for the acknowledge of this message.
  std::optional<std::uint64_t> awaited_message;
  /// A #TIMER READ SYN in hand waits until the interpolator has done it.
  bool awaits_timer = false;
  /// #ERROR with RC 7 was executed.
  bool restart_needed = false;
  /// #FLUSH CONTINUE stops the decoder as #FLUSH WAIT does.
  bool flush_continue_waits = false;
  /// Of the interpolator, in the channel's time scale.
  Duration cycle{};

  [[nodiscard]] Frame& frame() { return frames.back(); }
  [[nodiscard]] const syntax::Operation& operation() const {
    return frames.back().routine->operations[frames.back().position];
  }
  /// The interpolator has executed everything.
  [[nodiscard]] bool channel_empty() const {
    return around.queue.empty() && around.interpolator.idle();
  }
  /// Where the decoder is; of the program's end only the file.
  [[nodiscard]] Place place() const;
};

}  // namespace millrace::cnc::nc::run
