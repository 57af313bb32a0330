// Messages of lcm-gen's types to bytes and back, the second for bytes from strangers.
//
//   const std::string bytes = encode(request);
//   const auto reply = decode<millrace::reply_t>(bytes);   // or why not
//
// What lcm-gen 1.3 generates trusts counts and lengths: it makes room for as many elements as a
// message says that there are, and takes one away from the length of a string even if that is 0 or
// the smallest number. decode() lets neither through: the build adds a check of lengths to the
// generated code (idl/CMakeLists.txt), and of our types only presence_t counts, in its first field.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

#include <boost/endian/conversion.hpp>
#include <fmt/format.h>
#include <tl/expected.hpp>

namespace millrace::fabric::lcm {

template <typename Message>
std::string encode(const Message& message) {
  std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Fingerprint of the type, then its fields.
inline constexpr std::size_t fingerprint_size = 8;

/// The first field of a message that begins with a count; -1 if there is none.
inline std::int32_t leading_count(std::string_view bytes) {
  if (bytes.size() < fingerprint_size + sizeof(std::int32_t)) {
    return -1;
  }
  return boost::endian::load_big_s32(
      reinterpret_cast<const unsigned char*>(bytes.data() + fingerprint_size));
}

/// Whether `bytes` begin as a message of this type.
template <typename Message>
tl::expected<void, std::string> check_type(std::string_view bytes) {
  // Far above our own messages; longer ones are not examined.
  constexpr std::size_t most = 65'535;
  if (bytes.size() < fingerprint_size || bytes.size() > most) {
    return tl::unexpected(
        fmt::format("{} bytes are not a {}", bytes.size(), Message::getTypeName()));
  }
  const std::int64_t fingerprint =
      boost::endian::load_big_s64(reinterpret_cast<const unsigned char*>(bytes.data()));
  if (fingerprint != Message::getHash()) {
    return tl::unexpected(
        fmt::format("its fingerprint is {:016x}, that of {} is {:016x}: another type, or another "
                    "version of millrace's",
                    static_cast<std::uint64_t>(fingerprint), Message::getTypeName(),
                    static_cast<std::uint64_t>(Message::getHash())));
  }
  return {};
}

/// `bytes` must be one whole message. A type that counts is to be checked by leading_count()
/// before.
template <typename Message>
tl::expected<Message, std::string> decode(std::string_view bytes) {
  if (const auto type = check_type<Message>(bytes); !type) {
    return tl::unexpected(type.error());
  }
  try {
    Message message;
    const int size = static_cast<int>(bytes.size());
    const int used = message.decode(bytes.data(), 0, size);
    if (used == size) {
      return message;
    }
    return tl::unexpected(
        used < 0
            ? fmt::format("it ends in the middle of a {}, or a text in it has an impossible length",
                          Message::getTypeName())
            : fmt::format("{} bytes stand behind its {}", size - used, Message::getTypeName()));
  } catch (const std::exception&) {
    return tl::unexpected(
        fmt::format("a text in its {} has an impossible length", Message::getTypeName()));
  }
}

}  // namespace millrace::fabric::lcm
