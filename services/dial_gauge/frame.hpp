// Parses the frames that a receiver sends over its serial line, byte by byte.
//
//   FrameReader reader(Form::u_wave, Unit::mm);
//   reader.feed("DT10002-0000000.001M\r", [&](const Frame& frame) { … });
//
// Form u_wave, sent by receivers of this kind over their virtual serial port (57600 8N1). Recorded
// from real devices, not in a public manual:
//
//   DT1 cccc ±ddd.ddd u CR   value of channel cccc: 0 to 9999 (inferred: group and channel, two
//                            digits each), eleven characters after the sign, unit M (mm) or I
//                            (inch, inferred). Always 20 characters (inferred from recordings;
//                            required, because a lost digit would be a wrong value)
//   ST1 … CR, TI1 … CR       state messages of the receiver, no values
//
// Form digimatic, as in the vendor's manuals of gauges with a data output (Mitutoyo No. 99MAF600B,
// 6.3, 9600 8N1):
//
//   0 c A ±ddd.ddd CR        value of channel c, eight characters after the sign, no unit
//   9 c n CR                 the receiver's error n on channel c (inferred)
//
// LF counts as CR, so that a line that passed a terminal program reads the same.
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

/// The receiver reports that this channel has no value.
struct ErrorFrame {
  unsigned channel = 0;
  char code = '0';
  bool operator==(const ErrorFrame&) const = default;
};

/// A message without a value.
struct StateFrame {
  bool operator==(const StateFrame&) const = default;
};

/// Not a valid frame of this form; `text` is at most 64 bytes of it.
struct BrokenFrame {
  std::string text;
  bool operator==(const BrokenFrame&) const = default;
};

using Frame = std::variant<ValueFrame, ErrorFrame, StateFrame, BrokenFrame>;

/// Parses one frame without its CR.
Frame parse_frame(std::string_view text, Form form, Unit digimatic_unit);

/// Finds the frames in a stream. A frame without an end is broken once it is longer than any valid
/// one; reading continues after the next CR.
class FrameReader {
 public:
  FrameReader(Form form, Unit digimatic_unit) : form_(form), unit_(digimatic_unit) {}
  void feed(std::string_view bytes, const std::function<void(const Frame&)>& sink);
  /// The line was interrupted: drops the incomplete frame.
  void reset();

 private:
  void end_frame(const std::function<void(const Frame&)>& sink);

  Form form_;
  Unit unit_;
  std::string pending_;
  bool skipping_ = false;
};

}  // namespace millrace::services::dial_gauge
