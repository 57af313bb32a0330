// The system data of the virtual CNC, as a Rexroth MTX has them: named and typed, single values,
// structures and arrays, shared by all channels. NC programs write them with SSD and its relatives;
// ADS clients read and write them by name, whole or in part.
//
//   SystemData data({{"QUEUE", {{"", ElementType::text(127)}}, 100},
//                    {"CONTROL", {{"LastFilled", dint}, {"LastGet", dint}}}});
//   auto all = data.find("SD.QUEUE");                   // 100 texts of 128 bytes, in one piece
//   auto get = data.find("SD.CONTROL.LastGet");
//
// That there are structures and arrays, and that each is best read whole, is documented
// (DOK-MTX***-NC*F*EX*V13, p. 655). That elements count from 1 is inferred. Names with SD., upper
// and lower case as they are written, members without gaps between them, and that no channel has
// its own, are our choice.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/simulator/type.hpp"

namespace millrace::cnc::simulator {

struct DataMember {
  /// Empty: the data are no structure, and this is their only value.
  std::string name;
  ElementType element;
};

struct DataDeclaration {
  /// Without "SD.".
  std::string name;
  std::vector<DataMember> members;
  /// Of an array, counted from 1; 0 = no array.
  std::uint32_t elements = 0;
  /// What each element begins with, in its type; not for structures.
  nc::Value value = 0.0;

  [[nodiscard]] bool structure() const { return !members.front().name.empty(); }
  /// Of one element, in bytes.
  [[nodiscard]] std::uint32_t element_size() const;
  [[nodiscard]] std::uint32_t size() const {
    return element_size() * (elements == 0 ? 1 : elements);
  }
};

class SystemData {
 public:
  /// Their names differ.
  explicit SystemData(std::vector<DataDeclaration> declarations);

  /// Some of the data: all of a name, an element, a member of it.
  struct Place {
    std::uint32_t offset = 0;
    /// In bytes.
    std::uint32_t size = 0;
    /// Of a single value; nothing for an array or a structure.
    std::optional<ElementType> element{};
    /// Of an array that is meant whole; 0 otherwise.
    std::uint32_t elements = 0;
    /// The data that it is, or is a part of.
    const DataDeclaration* data = nullptr;
  };
  /// By name: "SD.CONTROL", "SD.QUEUE[3]", "SD.TABLE[3].TEXT".
  [[nodiscard]] std::optional<Place> find(std::string_view name) const;
  /// All data, in the order of their declaration.
  [[nodiscard]] std::vector<const DataDeclaration*> all() const;
  /// Of an array; 0 if there is none of this name.
  [[nodiscard]] std::uint32_t elements(std::string_view name) const;

  /// For programs; faults name the data.
  [[nodiscard]] tl::expected<nc::Value, nc::Fault> value(std::string_view name) const;
  tl::expected<void, nc::Fault> assign(std::string_view name, const nc::Value& value);

  /// For ADS clients: at most `room` bytes, none of other data. invalid_offset where there are
  /// none.
  [[nodiscard]] ads::Result<ads::Bytes> read(std::uint32_t offset, std::uint32_t room) const;
  /// invalid_size for what goes over the end of the data.
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

/// Whether a name is one of theirs, by its beginning.
[[nodiscard]] inline bool is_system_data(std::string_view name) {
  return name.starts_with("SD.");
}

}  // namespace millrace::cnc::simulator
