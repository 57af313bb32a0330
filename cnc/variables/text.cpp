#include "cnc/variables/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::cnc::variables {

std::string decode_text(ads::BytesView bytes) {
  return {bytes.begin(), std::ranges::find(bytes, 0)};
}

tl::expected<ads::Bytes, std::string> encode_text(std::string_view text) {
  if (text.size() > max_text) {
    return tl::make_unexpected(
        fmt::format("the text has {} bytes, a CNC string holds {}", text.size(), max_text));
  }
  if (const auto nul = text.find('\0'); nul != std::string_view::npos) {
    return tl::make_unexpected(
        fmt::format("the text has a NUL at byte {}, where a CNC string would end", nul));
  }
  ads::ByteWriter out;
  return out.text(text).u8(0).take();
}

}  // namespace millrace::cnc::variables
