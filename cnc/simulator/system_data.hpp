// The system data of the virtual CNC, like those of a Rexroth MTX: named and typed single values,
// structures and arrays, shared by all channels. NC programs write them with SSD and related
// functions; ADS clients read and write them by name, whole or in part.
//
//   SystemData data({{"QUEUE", {{"", ElementType::text(127)}}, 100},
//                    {"CONTROL", {{"LastFilled", dint}, {"LastGet", dint}}}});
//   auto all = data.find("SD.QUEUE");                   // 100 texts of 128 bytes, in one piece
//   auto get = data.find("SD.CONTROL.LastGet");
//
// Documented: there are structures and arrays, and each is best read whole (DOK-MTX***-NC*F*EX*V13,
// p. 655). Inferred: elements count from 1. Our choice: names begin with SD. and are
// case-sensitive, members have no gaps between them, and no channel has data of its own.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/simulator/type.hpp"

namespace millrace::cnc::simulator {

struct DataMember {
  /// Empty: the data are not a structure, and this is their only value.
  std::string name;
  ElementType element;
};

struct DataDeclaration {
  /// Without "SD.".
  std::string name;
  std::vector<DataMember> members;
  /// Elements of an array, counted from 1; 0 = not an array.
  std::uint32_t elements = 0;
  /// The initial value of each element, in its type; not for structures.
  nc::Value value = 0.0;

  [[nodiscard]] bool structure() const { return !members.front().name.empty(); }
  /// Bytes of one element.
  [[nodiscard]] std::uint32_t element_size() const;
  [[nodiscard]] std::uint32_t size() const {
    return element_size() * (elements == 0 ? 1 : elements);
  }
};

class SystemData {
 public:
  /// The names must differ.
  explicit SystemData(std::vector<DataDeclaration> declarations);

  /// A part of the data: all data of a name, an element, or a member of it.
  struct Place {
    std::uint32_t offset = 0;
    /// In bytes.
    std::uint32_t size = 0;
    /// Type of a single value; nullopt for an array or a structure.
    std::optional<ElementType> element{};
    /// Elements of a whole array; 0 for any other part.
    std::uint32_t elements = 0;
    /// The data of which this is a part or the whole.
    const DataDeclaration* data = nullptr;
  };
  /// Finds a part by name: "SD.CONTROL", "SD.QUEUE[3]", "SD.TABLE[3].TEXT".
  [[nodiscard]] std::optional<Place> find(std::string_view name) const;
  /// All data, in the order of their declaration.
  [[nodiscard]] std::vector<const DataDeclaration*> all() const;
  /// Elements of an array; 0 for any other name.
  [[nodiscard]] std::uint32_t elements(std::string_view name) const;

  /// For NC programs; faults contain the name of the data.
  [[nodiscard]] tl::expected<nc::Value, nc::Fault> value(std::string_view name) const;
  tl::expected<void, nc::Fault> assign(std::string_view name, const nc::Value& value);

  /// For ADS clients: at most `room` bytes, up to the end of one declaration. invalid_offset beyond
  /// all data.
  [[nodiscard]] ads::Result<ads::Bytes> read(std::uint32_t offset, std::uint32_t room) const;
  /// invalid_size for bytes beyond the end of one declaration.
  ads::Result<void> write(std::uint32_t offset, ads::BytesView bytes);

 private:
  struct Item {
    DataDeclaration declaration;
    std::uint32_t offset = 0;
  };
  [[nodiscard]] const Item* item(std::string_view name) const;
  [[nodiscard]] const Item* item_at(std::uint32_t offset) const;
  [[nodiscard]] tl::expected<Place, nc::Fault> single(std::string_view name) const;

  std::vector<Item> items_;
  ads::Bytes memory_;
};

/// True if a name begins with the prefix of system data.
[[nodiscard]] inline bool is_system_data(std::string_view name) {
  return name.starts_with("SD.");
}

}  // namespace millrace::cnc::simulator
