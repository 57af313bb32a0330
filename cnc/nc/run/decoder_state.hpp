// The state of the decoder during programs: the stack of routines, and what it waits for.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/run/interpolator.hpp"
#include "cnc/nc/run/macros.hpp"
#include "cnc/nc/run/memory.hpp"
#include "cnc/nc/run/message_box.hpp"
#include "cnc/nc/run/motion.hpp"
#include "cnc/nc/run/queue.hpp"
#include "cnc/nc/run/stream.hpp"
#include "cnc/nc/run/system_variables.hpp"
#include "cnc/nc/syntax/program.hpp"
#include "cnc/nc/timers.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

// The global subprograms and cycles that a running program has called, parsed once each.

class Library {
 public:
  /// Finds a program by the name in its call: first in the environment, then among the cycles of
  /// this library (shipped_cycle). A fault if it is in neither, has mistakes, or exceeds the number
  /// of programs.
  std::shared_ptr<const syntax::Program> find(const std::string& name, Environment& environment);
  /// Forgets all programs, since files may have changed.
  void clear() { programs_.clear(); }

 private:
  std::map<std::string, std::shared_ptr<const syntax::Program>> programs_;
};

/// A cycle that is called after each block with motion (or after each block).
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
  /// Index of the current operation.
  std::size_t position = 0;
  /// N number of the current block.
  long block_number = 0;
  std::optional<ModalCycle> modal;
  /// The stream supplies its blocks, packet by packet.
  bool streamed = false;
};

/// A routine that waits for its first packet.
[[nodiscard]] Frame streamed_frame(const std::string& name);

/// The other parts of the channel; they must outlive the decoder.
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
  /// The program name that means the stream; empty = none.
  std::string stream_name;
  /// The main program first; empty if no program runs.
  std::vector<Frame> frames;
  /// Block search: number of the block at which execution begins, until it is reached.
  std::optional<long> search;
  /// Blocks read since the program's start; repeated blocks count each time.
  std::uint64_t blocks_read = 0;
  /// Statements without an effect that the program has used.
  std::set<std::string> skipped{};
  /// #FILE NAME
  std::string report_file;
  /// The current #MSG ACK waits for the acknowledgement of this message.
  std::optional<std::uint64_t> awaited_message;
  /// The current #TIMER READ SYN waits for the interpolator.
  bool awaits_timer = false;
  /// #ERROR with RC 7 was executed.
  bool restart_needed = false;
  /// #FLUSH CONTINUE stops the decoder as #FLUSH WAIT does.
  bool flush_continue_waits = false;
  /// Cycle of the interpolator, in the channel's time scale.
  Duration cycle{};

  [[nodiscard]] Frame& frame() { return frames.back(); }
  [[nodiscard]] const syntax::Operation& operation() const {
    return frames.back().routine->operations[frames.back().position];
  }
  /// The interpolator has executed all blocks.
  [[nodiscard]] bool channel_empty() const {
    return around.queue.empty() && around.interpolator.idle();
  }
  /// The current place of the decoder; at the end of the program only the file.
  [[nodiscard]] Place place() const;
};

}  // namespace millrace::cnc::nc::run
