// The target of a writer's bytes, and the source of a reader's.
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

/// Takes the bytes of a file in order.
class Sink {
 public:
  virtual ~Sink() = default;
  /// All of `bytes`, or none and an error with the reason. The same bytes may be tried again.
  virtual tl::expected<void, std::string> write(Bytes bytes) = 0;
};

/// A file's bytes at any place.
class Source {
 public:
  virtual ~Source() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Reads `length` bytes from `offset` into `out`, fewer where the file ends or cannot be read.
  virtual void read(std::uint64_t offset, std::uint64_t length, std::string& out) = 0;
};

/// A file in memory, both ways.
class Memory : public Sink, public Source {
 public:
  Memory() = default;
  explicit Memory(std::string bytes) : bytes_(std::move(bytes)) {}

  tl::expected<void, std::string> write(Bytes bytes) override {
    bytes_.append(bytes);
    return {};
  }
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  void read(std::uint64_t offset, std::uint64_t length, std::string& out) override {
    out.clear();
    if (offset < bytes_.size()) {
      out.append(bytes_, static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
    }
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace millrace::tools::mcap
