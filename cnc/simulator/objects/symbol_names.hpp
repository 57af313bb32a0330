// Symbol names for the objects with fixed addresses, for clients that use handles and symbols. The
// vendor does not document which objects have a symbol name, so the names are our choice.
//
//   cnc_version_r                     an object of the whole CNC
//   CH[2].mc_command_mode_w           an object of channel 2
//   CH[2].AX[1].actual position       of its first axis
//   CH[2].V.G.SERVICE.REQUEST_STATE   a variable of channel 2, behind the port that owns them
//   SD.QUEUE, SD.CONTROL.LastGet      system data, behind the same port; the bytes of an array or
//                                     structure
//
// Each AMS port has its own objects, by the names in the object directory or in attribute 0x100.
// Names are case-insensitive, except those of variables. Types have the names of IEC 61131-3, which
// clients know: UDINT where the CNC's own functions write UNS32, STRING(127), ARRAY [0..127] OF
// UDINT, SD_CONTROL for the structure SD.CONTROL.
#pragma once

#include "cnc/ads/symbols.hpp"
#include "cnc/simulator/objects/catalogue.hpp"

namespace millrace::cnc::simulator::objects {

class SymbolNames : public ads::SymbolDirectory {
 public:
  /// Both must outlive this object.
  SymbolNames(Machine& machine, const Catalogue& catalogue)
      : machine_(machine), catalogue_(catalogue) {}

  [[nodiscard]] std::optional<ads::Symbol> find(std::uint16_t port,
                                                std::string_view name) const override;
  /// The objects never change.
  [[nodiscard]] std::uint8_t version(std::uint16_t /*port*/) const override { return 1; }
  [[nodiscard]] std::vector<ads::Symbol> all(std::uint16_t port) const override;
  [[nodiscard]] std::optional<ads::DataType> structure(std::uint16_t port,
                                                       std::string_view name) const override;

 private:
  [[nodiscard]] std::uint32_t number_of(const Group& group) const;
  /// A symbol with the number of its type.
  [[nodiscard]] ads::Symbol symbol(std::string name, ads::Index index, std::uint32_t size,
                                   std::string type, std::string unit = "") const;
  [[nodiscard]] ads::Symbol symbol_of(const Catalogue::Place& place, std::uint32_t channel,
                                      std::uint32_t axis) const;
  void add_objects(std::vector<ads::Symbol>& symbols, std::uint16_t port, std::uint32_t channel,
                   std::uint32_t axis) const;
  [[nodiscard]] std::optional<ads::Symbol> find_variable(const VirtualChannel& channel,
                                                         std::string_view name) const;
  [[nodiscard]] std::optional<ads::Symbol> find_system_data(std::string_view name) const;

  Machine& machine_;
  const Catalogue& catalogue_;
};

}  // namespace millrace::cnc::simulator::objects
