// What a receiver sends over its serial line, taken apart byte by byte.
//
//   FrameReader reader(Form::u_wave, Unit::mm);
//   reader.feed("DT10002-0000000.001M\r", [&](const Frame& frame) { … });
//
// Form u_wave, as receivers of this kind send it over their virtual serial port (57600 8N1). Seen
// on real devices, not in a public manual:
//
//   DT1 cccc ±ddd.ddd u CR   value of channel cccc: 0 to 9999 (inferred: group and channel, two
//                            digits each), eleven characters after the sign, unit M (mm) or I
//                            (inch, inferred). Always 20 characters (inferred from what was seen;
//                            required, because a lost digit would be a wrong value)
//   ST1 … CR, TI1 … CR       state messages of the receiver, no values
//
// Form digimatic, as in the vendor's manuals of gauges with a data output (Mitutoyo No. 99MAF600B,
// 6.3, 9600 8N1):
//
//   0 c A ±ddd.ddd CR        value of channel c, eight characters after the sign, no unit
//   9 c n CR                 the receiver's error n on channel c (inferred)
//
// LF is taken for CR, so that a line that passed a terminal program reads the same.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>

#include "services/dial_gauge/length.hpp"

namespace millrace::services::dial_gauge {

enum class Form : std::uint8_t { u_wave, digimatic };

struct ValueFrame {
  unsigned channel = 0;
  Nanometres value = 0;
  bool operator==(const ValueFrame&) const = default;
};

/// The receiver says that this channel has no value to give.
struct ErrorFrame {
  unsigned channel = 0;
  char code = '0';
  bool operator==(const ErrorFrame&) const = default;
};

/// Nothing to do with values.
struct StateFrame {
  bool operator==(const StateFrame&) const = default;
};

/// No frame of this form; `text` is at most 64 bytes of what came.
struct BrokenFrame {
  std::string text;
  bool operator==(const BrokenFrame&) const = default;
};

using Frame = std::variant<ValueFrame, ErrorFrame, StateFrame, BrokenFrame>;

/// One frame without its CR.
Frame parse_frame(std::string_view text, Form form, Unit digimatic_unit);

/// Finds the frames in a stream. A frame that does not end is broken once it is longer than any
/// could be; reading goes on behind the next CR.
class FrameReader {
 public:
  FrameReader(Form form, Unit digimatic_unit) : form_(form), unit_(digimatic_unit) {}
  void feed(std::string_view bytes, const std::function<void(const Frame&)>& sink);
  /// The line was interrupted: what is half there will not be completed.
  void reset();

 private:
  void end_frame(const std::function<void(const Frame&)>& sink);

  Form form_;
  Unit unit_;
  std::string pending_;
  bool skipping_ = false;
};

}  // namespace millrace::services::dial_gauge
