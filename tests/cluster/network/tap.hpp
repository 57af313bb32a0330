// A TAP device: an Ethernet interface of a network namespace whose other end is a descriptor.
#pragma once

#include <filesystem>
#include <string>

namespace millrace::tests::cluster {

class Tap {
 public:
  /// Makes the device `name` in the namespace; it vanishes with this object. Throws
  /// std::system_error.
  Tap(const std::filesystem::path& network_namespace, const std::string& name);
  ~Tap();
  Tap(Tap&& other) noexcept;
  Tap& operator=(Tap&&) = delete;

  /// For poll().
  [[nodiscard]] int descriptor() const { return descriptor_; }
  /// The next frame, or an empty string if there is none. Never blocks.
  [[nodiscard]] std::string read() const;
  /// The frame is lost if the host has no room for it, as on a wire.
  void write(const std::string& frame) const;

 private:
  int descriptor_;
};

}  // namespace millrace::tests::cluster
