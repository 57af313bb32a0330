// `millrace trust`: the roles of participants on a fabric. Creates and keeps their credentials.
#pragma once

#include <string>
#include <utility>

#include <CLI/App.hpp>

#include "base/program/command_line.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/trust/pki_folder.hpp"

namespace millrace::tools::commands::trust {

// The common options of `millrace trust`: the PKI folder, and how its CAs are opened.

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

void add_trust(CLI::App& app, Chosen& chosen);

// The commands of `millrace trust` that write a PKI folder.

void add_init(CLI::App& trust, Chosen& chosen);
void add_issue(CLI::App& trust, Chosen& chosen);
void add_renew(CLI::App& trust, Chosen& chosen);
void add_renew_authorities(CLI::App& trust, Chosen& chosen);
void add_revoke(CLI::App& trust, Chosen& chosen);

}  // namespace millrace::tools::commands::trust
