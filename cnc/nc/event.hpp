// The events of a running channel.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "cnc/nc/diagnostic.hpp"

namespace millrace::cnc::nc {

/// #MSG and #MSG INFO: a text for a receiver.
struct MessageEvent {
  std::string text;
  /// ISG_DIAG_BED, DIAG, HMI, PLC or EVENT_LOGGER (IB/tf5200_programming_manual/507845131).
  std::string receiver = "ISG_DIAG_BED";
  /// Counts the messages of the channel from 1; the argument of Channel::acknowledge.
  std::uint64_t number = 0;
  /// The program waits until this message is acknowledged (modes ACK and SYN_ACK).
  bool needs_acknowledge = false;
  /// #MSG INFO: data for the receiver, not for the operator.
  bool info = false;
};

/// #MSG SAVE: text to append to the report file, with line end and time stamp as the program
/// requests.
struct SaveEvent {
  std::string file;
  std::string text;
  bool time_stamp = false;
  bool line_end = true;
};

/// An M function was executed that the language does not define itself (M00-M02, M17, M29, M30).
struct MachineFunctionEvent {
  int number = 0;
  /// M52=-345: a value for the PLC (IB/tccncprogramming/15556839051, documented).
  std::optional<double> argument{};
};

/// M00, M01 with the optional stop enabled, or a single step: the program waits for
/// Channel::resume.
struct HeldEvent {
  Place place;
  /// A single step: the program stops before its next block.
  bool single_step = false;
};

/// A warning; the program continues (error class 0 or 1 of the kernel).
struct WarningEvent {
  Diagnostic what;
};

/// The program reached M30 or M02, or its last block.
struct FinishedEvent {};

/// The program was aborted; the channel is in the state `error` until it is reset.
struct AbortedEvent {
  Diagnostic why;
  /// The program raised a fatal error (#ERROR with RC 7); a reset does not clear it.
  bool restart_needed = false;
};

using Event = std::variant<MessageEvent, SaveEvent, MachineFunctionEvent, HeldEvent, WarningEvent,
                           FinishedEvent, AbortedEvent>;

}  // namespace millrace::cnc::nc
