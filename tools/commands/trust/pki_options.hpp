// The common options of `millrace trust`: the PKI folder, and how its CAs are opened.
#pragma once

#include <string>
#include <utility>

#include <CLI/App.hpp>

#include "base/program/command_line.hpp"
#include "tools/trust/pki_folder.hpp"

namespace millrace::tools::commands::trust {

struct PkiOptions {
  std::string folder;
  std::string passphrase_file;
};

/// The PKI folder, which is the first argument.
void add_pki_folder(CLI::App& command, PkiOptions& options);
/// `--passphrase-file`.
void add_passphrase(CLI::App& command, PkiOptions& options);

/// The first line of the file; empty without one. Throws base::program::UsageError.
std::string passphrase_of(const PkiOptions& options);
/// Throws base::program::UsageError.
tools::trust::PkiFolder open(const PkiOptions& options);
/// Read-only: needs no lock. Throws base::program::UsageError.
tools::trust::PkiFolder look(const PkiOptions& options);
/// Of this host's clock.
tools::trust::Time now();

/// The value, or base::program::UsageError with the error.
template <typename T>
T must(tl::expected<T, std::string> result) {
  if (!result) {
    throw base::program::UsageError(result.error());
  }
  if constexpr (!std::is_void_v<T>) {
    return std::move(*result);
  }
}

}  // namespace millrace::tools::commands::trust
