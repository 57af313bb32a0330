// Reads files that decide whom a process trusts, and its own credentials. A file must not be
// writable by other users; a secret must not be readable by all of them.
//
//   auto key = read_guarded("key.pem", Secrecy::secret);
//   if (!key) … key.error().what, key.error().advice
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace millrace::base::posix {

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

/// The contents of a regular file. Other kinds are a fault: opening a pipe would wait for its
/// writer.
tl::expected<std::string, FileFault> read_guarded(const std::filesystem::path& file,
                                                  Secrecy secrecy);

/// The fault of a world-writable folder. A sticky one such as /tmp has none: there, other users
/// cannot replace a file of its owner.
std::optional<FileFault> fault_of_folder(const std::filesystem::path& folder);

}  // namespace millrace::base::posix
