// Owner of a file descriptor, errors of the system as text, the name of this host.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace millrace::base::posix {

// Owner of a file descriptor.
//
//   Fd fd(::open(name, O_RDONLY | O_CLOEXEC));
//   if (!fd) return tl::unexpected(last_error("open", name));

/// Closes in its destructor; -1 = no descriptor.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  ~Fd();
  Fd(Fd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Fd& operator=(Fd&& other) noexcept;
  Fd(const Fd&) = delete;
  Fd& operator=(const Fd&) = delete;

  explicit operator bool() const { return fd_ >= 0; }
  [[nodiscard]] int get() const { return fd_; }
  /// Transfers the descriptor to the caller, who closes it.
  [[nodiscard]] int release() { return std::exchange(fd_, -1); }
  void close();

 private:
  int fd_ = -1;
};

/// errno as text: "WHAT: No such file or directory".
std::string last_error(std::string_view what);

// The name of this host.

/// As `hostname` prints it; empty if the system does not return it.
std::string host_name();

}  // namespace millrace::base::posix
