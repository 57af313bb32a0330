// Framing: splits the bytes of a stream into frames, and decodes the AMS header inside them.
//
//   FrameReader reader(max_frame, Framing::ams_tcp);
//   reader.feed(received);
//   while (auto frame = reader.next()) {          // an error ends the connection: no way to resync
//     if (!*frame) break;                         // more bytes are needed
//     auto packet = decode_packet((*frame)->body);
//   }
//
// All integers are little endian. Sources: Beckhoff's ADS protocol pages (IB/tc3_ads_intro,
// documented); the router's frames 0x0001 and 0x1000..0x1002 are inferred from open-source clients.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "cnc/ads/address.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/error.hpp"

namespace millrace::cnc::ads {

inline constexpr std::size_t frame_header_size = 6;
inline constexpr std::size_t packet_header_size = 32;

/// How frames are delimited on a connection.
enum class Framing : std::uint8_t {
  /// Each frame follows a 6-byte AMS/TCP header: plain ADS.
  ams_tcp,
  /// AMS headers and their data only: Secure ADS. There are no router frames.
  headerless,
};

/// The kind of an AMS/TCP frame (its first 16 bits).
enum class FrameKind : std::uint16_t {
  ads = 0,
  port_close = 0x0001,
  port_connect = 0x1000,
  router_note = 0x1001,
  get_local_net_id = 0x1002,
};

/// One AMS/TCP frame without its 6-byte header; valid until the reader is fed again.
struct Frame {
  FrameKind kind = FrameKind::ads;
  BytesView body;
};

/// Why the bytes of a peer cannot be decoded, as text.
struct ProtocolError {
  std::string message;
};

/// Splits a byte stream into frames. Allocates memory for the bytes received, never for the length
/// announced.
class FrameReader {
 public:
  /// A frame that announces a body longer than `max_frame` bytes is an error.
  explicit FrameReader(std::size_t max_frame, Framing framing = Framing::ams_tcp)
      : max_frame_(max_frame), framing_(framing) {}

  void feed(BytesView bytes);
  /// The next whole frame; nullopt if more bytes are needed; an error if the stream cannot be
  /// decoded any further.
  tl::expected<std::optional<Frame>, ProtocolError> next();
  /// Bytes fed but not yet returned.
  [[nodiscard]] std::size_t pending() const { return buffer_.size() - consumed_; }

 private:
  struct Announced {
    FrameKind kind = FrameKind::ads;
    /// Bytes in front of the body.
    std::size_t header = 0;
    std::size_t body = 0;
  };
  /// What the available bytes announce about the next frame; nullopt if more are needed.
  [[nodiscard]] std::optional<Announced> announced() const;

  std::size_t max_frame_;
  Framing framing_;
  Bytes buffer_;
  std::size_t consumed_ = 0;
};

/// ADS commands.
enum class Command : std::uint16_t {
  read_device_info = 1,
  read = 2,
  write = 3,
  read_state = 4,
  write_control = 5,
  add_notification = 6,
  delete_notification = 7,
  notification = 8,
  read_write = 9,
};

/// State flags of an AMS header. On the wire of a TwinCAT only 4 (request, notification) and 5
/// (response) are seen.
namespace flags {
inline constexpr std::uint16_t response = 0x0001;
inline constexpr std::uint16_t no_return = 0x0002;
inline constexpr std::uint16_t ads_command = 0x0004;
}  // namespace flags

/// The AMS header without its data length, which is the size of the data.
struct Header {
  Address target;
  Address source;
  Command command{};
  std::uint16_t flags = flags::ads_command;
  /// Set by routers (6, 7 …); then the data may be empty.
  ErrorCode error = ErrorCode::none;
  /// Chosen by the requester, repeated in the response.
  std::uint32_t invoke_id = 0;

  [[nodiscard]] bool is_response() const { return (flags & flags::response) != 0; }
  bool operator==(const Header&) const = default;
};

/// The body of an ADS frame; data is a view into it.
struct Packet {
  Header header;
  BytesView data;
};

/// Fails if the header is truncated or its data length disagrees with the frame's.
tl::expected<Packet, ProtocolError> decode_packet(BytesView body);

/// A whole frame of kind ads, in the format of Framing::ams_tcp.
Bytes encode_packet(const Header& header, BytesView data);
/// A whole frame of another kind.
Bytes encode_frame(FrameKind kind, BytesView body);

/// Appends whole frames, as encode_packet() returns them, to the output of a connection.
void append_frames(Bytes& output, BytesView frames, Framing framing);

/// The header of the response to `request`: addresses swapped, flags 5, same command and invoke id.
Header response_header(const Header& request, ErrorCode error = ErrorCode::none);

}  // namespace millrace::cnc::ads
