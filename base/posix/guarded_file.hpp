// Files that decide whom a program believes, or what proves who it is: read only if others cannot
// have written them, and secrets only if not everybody can read them.
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
  /// Not everybody may write it.
  open,
  /// Besides, its group may not write it, and not everybody may read it.
  secret,
};

/// What is wrong with a file, and what to do.
struct FileFault {
  /// "everybody on this host can write it"
  std::string what;
  /// Empty where it is not there.
  std::string advice;
};

/// What is in a regular file. To open a pipe would wait for its writer, so that is a fault.
tl::expected<std::string, FileFault> read_guarded(const std::filesystem::path& file,
                                                  Secrecy secrecy);

/// A folder that everybody may write, but for one that is sticky, as /tmp, where others replace no
/// file of its owner.
std::optional<FileFault> fault_of_folder(const std::filesystem::path& folder);

}  // namespace millrace::base::posix
