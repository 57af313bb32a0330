// Reads whole files that people name: configurations, certificates, passwords.
//
//   if (auto text = read_regular(file); !text) … text.error()
//
// Reads files that decide whom a process trusts, and its own credentials. A file must not be
// writable by other users; a secret must not be readable by all of them.
//
//   auto key = read_guarded("key.pem", Secrecy::secret);
//   if (!key) … key.error().what, key.error().advice
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace millrace::base::posix {

/// Of a file that is read at once, in bytes.
inline constexpr std::size_t largest_file = std::size_t{16} << 20U;

/// The contents of a regular file. A pipe (which waits for its writer), a device (which may have no
/// end) and a file with more than `most` bytes are errors. The error is the reason, without the
/// name.
tl::expected<std::string, std::string> read_regular(const std::filesystem::path& file,
                                                    std::size_t most = largest_file);

/// The first line of such a file, without its end. Also an error: there is none.
tl::expected<std::string, std::string> read_first_line(const std::filesystem::path& file);

enum class Secrecy : std::uint8_t {
  /// Not world-writable.
  open,
  /// Also not group-writable, and not world-readable.
  secret,
};

/// A fault of a file, and what to do.
struct FileFault {
  /// For example "all users of this host can write it".
  std::string what;
  /// Empty if there is no advice.
  std::string advice;
};

/// As read_regular().
tl::expected<std::string, FileFault> read_guarded(const std::filesystem::path& file,
                                                  Secrecy secrecy);

/// The fault of a world-writable folder. A sticky one such as /tmp has none: there, other users
/// cannot replace a file of its owner.
std::optional<FileFault> fault_of_folder(const std::filesystem::path& folder);

}  // namespace millrace::base::posix
