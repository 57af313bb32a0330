// The fields that the samples of a fabric share, between their C and C++ form. For codecs only.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>

#include "fabric/wire/codec.hpp"

namespace millrace::fabric::wire {

/// Fills one sample; the first value that does not fit becomes the error.
template <typename Sample>
class Filler {
 public:
  /// A NUL-terminated string of the field's size.
  template <std::size_t size>
  void string(char (&field)[size], const std::string& value, std::string_view what) {
    if (value.size() >= size) {
      fail(fmt::format("the {} has {} bytes, at most {} fit", what, value.size(), size - 1));
    } else if (value.find('\0') != std::string::npos) {
      fail(fmt::format("the {} contains a NUL byte", what));
    } else {
      std::memcpy(field, value.c_str(), value.size() + 1);
    }
  }

  void key(const ChannelKey& value) {
    if (value.machine.empty()) {
      fail("the machine has no name");
    }
    string(sample.machine, value.machine, "machine name");
    sample.channel = value.channel;
  }

  void text(const std::string& value) {
    if (value.size() > max_text) {
      fail(fmt::format("the text has {} bytes, at most {} fit", value.size(), max_text));
      return;
    }
    const auto size = static_cast<std::uint32_t>(value.size());
    // Cyclone only reads what it writes out; the pointer is not const because it is a C struct.
    sample.text._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(value.data()));
    sample.text._length = size;
    sample.text._maximum = size;
    sample.text._release = false;
  }

  void channels(millrace_ChannelList& field, const std::vector<std::uint16_t>& value) {
    constexpr std::size_t most = 255;
    if (value.size() > most) {
      fail(fmt::format("{} channels are named, at most {} fit", value.size(), most));
      return;
    }
    const auto size = static_cast<std::uint32_t>(value.size());
    field._buffer = const_cast<std::uint16_t*>(value.data());
    field._length = size;
    field._maximum = size;
    field._release = false;
  }

  Encoded<Sample> result() {
    if (!error_.empty()) {
      return tl::unexpected(std::move(error_));
    }
    return sample;
  }

  Sample sample{};

 private:
  void fail(std::string error) {
    if (error_.empty()) {
      error_ = std::move(error);
    }
  }

  std::string error_;
};

/// Makes a sequence of a sample of these; it does not own them.
template <typename Sequence, typename Element>
void lend(Sequence& field, std::vector<Element>& elements) {
  const auto size = static_cast<std::uint32_t>(elements.size());
  field._buffer = elements.data();
  field._length = size;
  field._maximum = size;
  field._release = false;
}

/// The same of elements that stay as they are: Cyclone only reads what it writes out; the pointer
/// is not const because it is a C struct.
template <typename Sequence, typename Element>
void borrow(Sequence& field, const std::vector<Element>& elements) {
  lend(field, const_cast<std::vector<Element>&>(elements));
}

/// A sequence of bytes that does not own them, as borrow().
template <typename Field>
Field borrow_bytes(const std::string& text) {
  Field field{};
  const auto size = static_cast<std::uint32_t>(text.size());
  field._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
  field._length = size;
  field._maximum = size;
  field._release = false;
  return field;
}

template <typename Sequence>
auto elements_of(const Sequence& field) {
  return std::span(field._buffer, field._length);
}

inline void put(millrace_InstanceId& field, const InstanceId& value) {
  std::copy(value.bytes.begin(), value.bytes.end(), std::begin(field));
}

inline InstanceId get(const millrace_InstanceId& field) {
  InstanceId value;
  std::copy(std::begin(field), std::end(field), value.bytes.begin());
  return value;
}

inline millrace_CallId put(const CallId& value) {
  return {value.epoch, value.number};
}
inline CallId get(const millrace_CallId& field) {
  return {field.epoch, field.number};
}

inline std::int64_t put(Time value) {
  return value.time_since_epoch().count();
}
inline Time get(std::int64_t field) {
  return Time(std::chrono::nanoseconds(field));
}

inline std::string get(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}
inline std::string get(const millrace_CncText& field) {
  return get(std::span(field._buffer, field._length));
}
inline std::string get(const millrace_ForeignText& field) {
  return get(std::span(field._buffer, field._length));
}

inline std::vector<std::uint16_t> get(const millrace_ChannelList& field) {
  const std::span channels(field._buffer, field._length);
  return {channels.begin(), channels.end()};
}

template <typename Sample>
ChannelKey get_key(const Sample& sample) {
  return {sample.machine, sample.channel};
}

/// What an enumeration holds: a foreign one may hold what none of its names stands for, and C++
/// does not let that be read as one of C, not even by std::bit_cast.
template <typename Enumeration>
constexpr auto number_of(const Enumeration& value) {
  if (std::is_constant_evaluated()) {
    return static_cast<std::underlying_type_t<Enumeration>>(value);
  }
  std::underlying_type_t<Enumeration> number{};
  std::memcpy(&number, &value, sizeof number);
  return number;
}

/// The enumerations of fabric/messages repeat those of the IDL in the same order.
template <typename To, typename From>
constexpr To convert(const From& value) {
  return static_cast<To>(number_of(value));
}

}  // namespace millrace::fabric::wire
