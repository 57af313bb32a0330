// Access by names and handles, which every ADS device with symbols offers. A decorator over a
// device and the directory of its symbols.
//
//   Symbols with_symbols(device, directory);
//   SumCommands with_sums(with_symbols);
//
// Clients that know no address upload the symbols and their types, and read a type by its name. The
// decorator reads and writes the value of a handle or name at its index group and offset of the
// inner device. Layouts: Beckhoff's TcAdsDef.h (documented); the long response to a handle request
// is inferred from open-source clients.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cnc/ads/data_types.hpp"
#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

/// Index groups of the symbol services.
namespace symbol {
/// ReadWrite: name in, handle out; with the known properties of its type if more than 4 bytes are
/// requested.
inline constexpr std::uint32_t handle_by_name = 0xF003;
/// ReadWrite: name in, value out.
inline constexpr std::uint32_t value_by_name = 0xF004;
/// Read or Write, offset: handle.
inline constexpr std::uint32_t value_by_handle = 0xF005;
/// Write: handle.
inline constexpr std::uint32_t release_handle = 0xF006;
/// ReadWrite: name in; group, offset and size out.
inline constexpr std::uint32_t place_by_name = 0xF007;
/// Read: one byte that changes when the symbols do.
inline constexpr std::uint32_t version = 0xF008;
/// ReadWrite: name in, whole symbol entry out.
inline constexpr std::uint32_t info_by_name = 0xF009;
/// Read: the entries of all symbols, as info_by_name returns them, one after the other.
inline constexpr std::uint32_t upload = 0xF00B;
/// Read: the number of these symbols, and of their bytes.
inline constexpr std::uint32_t upload_info = 0xF00C;
/// Read: the types of all symbols, and the types that these contain.
inline constexpr std::uint32_t type_upload = 0xF00E;
/// Read: symbols and bytes, types and bytes, two numbers for dynamic symbols.
inline constexpr std::uint32_t upload_info_2 = 0xF00F;
/// ReadWrite: name of a type in, its entry of the upload out.
inline constexpr std::uint32_t type_by_name = 0xF011;
}  // namespace symbol

struct Symbol {
  /// As the device writes it; two spellings of one name lead to the same symbol.
  std::string name;
  Index index;
  /// Bytes of the value.
  std::uint32_t size = 0;
  /// ADST_…: 19 UNS32, 30 string, 65 anything else …
  std::uint32_t type = 65;
  std::uint32_t flags = 0;
  std::string type_name;
  std::string comment;
};

/// The symbols of a device.
class SymbolDirectory {
 public:
  virtual ~SymbolDirectory() = default;
  /// The symbol of this name (CP1252, without NUL) behind an AMS port.
  [[nodiscard]] virtual std::optional<Symbol> find(std::uint16_t port,
                                                   std::string_view name) const = 0;
  [[nodiscard]] virtual std::uint8_t version(std::uint16_t port) const = 0;
  /// All symbols, each once; empty if a device does not list them.
  [[nodiscard]] virtual std::vector<Symbol> all(std::uint16_t /*port*/) const { return {}; }
  /// A structure by the name of its type.
  [[nodiscard]] virtual std::optional<DataType> structure(std::uint16_t /*port*/,
                                                          std::string_view /*name*/) const {
    return std::nullopt;
  }
};

/// A handle belongs to an AMS port and stays until it is released as often as it was requested. The
/// same name gets the same handle, so there are never more handles than symbols.
class Symbols final : public ForwardingDevice {
 public:
  /// Both must outlive this.
  Symbols(Device& inner, const SymbolDirectory& directory)
      : ForwardingDevice(inner), directory_(directory) {}

  Result<Bytes> read(std::uint16_t port, Index index, std::uint32_t length) override;
  Result<void> write(std::uint16_t port, Index index, BytesView data) override;
  Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                           BytesView data) override;
  /// The number of handles that are not released.
  [[nodiscard]] std::size_t handles() const { return handles_.size(); }

 private:
  struct Handle {
    std::uint16_t port = 0;
    Symbol symbol;
    std::uint32_t users = 0;
  };

  [[nodiscard]] Bytes upload(std::uint16_t port, std::uint32_t group) const;
  [[nodiscard]] std::vector<DataType> types(std::uint16_t port,
                                            const std::vector<Symbol>& symbols) const;
  [[nodiscard]] Structures structures_of(std::uint16_t port) const;
  std::uint32_t open(std::uint16_t port, const Symbol& symbol);
  Result<void> release(std::uint16_t port, std::uint32_t handle);
  [[nodiscard]] Result<Symbol> symbol_of(std::uint16_t port, std::uint32_t handle) const;

  const SymbolDirectory& directory_;
  std::map<std::uint32_t, Handle> handles_;
  std::uint32_t next_handle_ = 1;
};

}  // namespace millrace::cnc::ads
