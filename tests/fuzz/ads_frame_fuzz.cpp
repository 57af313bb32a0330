// A server's path from bytes to responses: the frames do not depend on how the bytes are cut into
// segments, and each response is a well-formed frame.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "cnc/ads/session.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace {

using namespace millrace::cnc::ads;

constexpr std::size_t max_frame = 1000;

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

// The frames when the input arrives in segments of this size.
std::vector<Bytes> frames_in(BytesView input, std::size_t segment, Framing framing) {
  std::vector<Bytes> frames;
  FrameReader reader(max_frame, framing);
  while (!input.empty()) {
    const auto size = std::min(segment, input.size());
    reader.feed(input.first(size));
    input = input.subspan(size);
    for (auto frame = reader.next();; frame = reader.next()) {
      if (!frame) {
        return frames;
      }
      if (!*frame) {
        break;
      }
      frames.push_back(encode_frame((*frame)->kind, (*frame)->body));
    }
    require(reader.pending() < frame_header_size + max_frame);
  }
  return frames;
}

void serve(const std::vector<Bytes>& frames) {
  MemoryDevice memory;
  memory.values[{1, 1}] = {1, 2, 3, 4, 5, 6, 7, 8};
  memory.values[{1, 2}] = {9};
  SumCommands device(memory, max_frame);
  Session session(device, {});
  Moment now;
  for (const auto& frame : frames) {
    ByteReader in(frame);
    const FrameKind kind{in.u16()};
    in.u32();
    const auto reaction = session.react({kind, in.rest()}, now);
    if (!reaction) {
      return;
    }
    FrameReader answers(2 * max_frame);
    answers.feed(*reaction);
    answers.feed(session.poll(now));
    now.steady += std::chrono::milliseconds(1);
    while (answers.pending() > 0) {
      const auto answer = answers.next();
      require(answer && *answer);
      require((*answer)->kind != FrameKind::ads || decode_packet((*answer)->body).has_value());
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesView input(data, size);
  for (const auto framing : {Framing::ams_tcp, Framing::headerless}) {
    const auto frames = frames_in(input, size, framing);
    require(frames == frames_in(input, 1, framing));
    require(frames == frames_in(input, 7, framing));
    serve(frames);
  }
  return 0;
}
