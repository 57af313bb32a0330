#include "cnc/simulator/system_data.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"

namespace millrace::cnc::simulator {

namespace {

constexpr std::size_t prefix_length = 3;  // SD.

/// The parts of a name: "SD.TABLE[3].TEXT" is TABLE, 3 and TEXT.
struct Parts {
  std::string_view name;
  std::optional<std::uint32_t> index;
  std::string_view member;
};

std::optional<Parts> parts_of(std::string_view text) {
  if (!is_system_data(text)) {
    return std::nullopt;
  }
  text.remove_prefix(prefix_length);
  const std::size_t end = std::min(text.find_first_of("[."), text.size());
  Parts parts{text.substr(0, end), std::nullopt, {}};
  text.remove_prefix(end);
  if (text.starts_with('[')) {
    const std::size_t close = std::min(text.find(']'), text.size());
    parts.index = base::text::parse_number<std::uint32_t>(text.substr(1, close - 1));
    if (close == text.size() || !parts.index) {
      return std::nullopt;
    }
    text.remove_prefix(close + 1);
  }
  if (text.starts_with('.')) {
    parts.member = text.substr(1);
  } else if (!text.empty()) {
    return std::nullopt;
  }
  return parts;
}

}  // namespace

std::uint32_t DataDeclaration::element_size() const {
  return std::accumulate(
      members.begin(), members.end(), 0U,
      [](std::uint32_t sum, const DataMember& member) { return sum + member.element.size; });
}

SystemData::SystemData(std::vector<DataDeclaration> declarations) {
  for (DataDeclaration& declaration : declarations) {
    const auto offset = static_cast<std::uint32_t>(memory_.size());
    memory_.resize(memory_.size() + declaration.size(), 0);
    items_.push_back({std::move(declaration), offset});
    const DataDeclaration& added = items_.back().declaration;
    if (!added.structure()) {
      // The configuration reader has checked that it fits.
      const auto bytes = encode(added.members.front().element, added.value);
      for (std::uint32_t at = offset; bytes && at < memory_.size(); at += added.element_size()) {
        std::copy(bytes->begin(), bytes->end(), memory_.begin() + at);
      }
    }
  }
}

const SystemData::Item* SystemData::item(std::string_view name) const {
  const auto found = std::ranges::find(
      items_, name, [](const Item& item) -> const std::string& { return item.declaration.name; });
  return found == items_.end() ? nullptr : &*found;
}

const SystemData::Item* SystemData::item_at(std::uint32_t offset) const {
  const auto behind = std::ranges::upper_bound(items_, offset, {}, &Item::offset);
  if (behind == items_.begin() || offset >= memory_.size()) {
    return nullptr;
  }
  return &*std::prev(behind);
}

std::optional<SystemData::Place> SystemData::find(std::string_view name) const {
  const auto parts = parts_of(name);
  const Item* const found = parts ? item(parts->name) : nullptr;
  if (found == nullptr) {
    return std::nullopt;
  }
  const DataDeclaration& declaration = found->declaration;
  Place place{.offset = found->offset, .size = declaration.size(), .data = &declaration};
  const bool array = declaration.elements > 0;
  if (parts->index) {
    if (*parts->index < 1 || *parts->index > declaration.elements) {
      return std::nullopt;
    }
    place.size = declaration.element_size();
    place.offset += (*parts->index - 1) * place.size;
  }
  const bool whole_array = array && !parts->index;
  place.elements = whole_array ? declaration.elements : 0;
  if (parts->member.empty()) {
    if (!whole_array && !declaration.structure()) {
      place.element = declaration.members.front().element;
    }
    return place;
  }
  if (whole_array || !declaration.structure()) {
    return std::nullopt;
  }
  for (const DataMember& member : declaration.members) {
    if (member.name == parts->member) {
      place.size = member.element.size;
      place.element = member.element;
      return place;
    }
    place.offset += member.element.size;
  }
  return std::nullopt;
}

std::vector<const DataDeclaration*> SystemData::all() const {
  std::vector<const DataDeclaration*> declarations;
  declarations.reserve(items_.size());
  for (const Item& item : items_) {
    declarations.push_back(&item.declaration);
  }
  return declarations;
}

std::uint32_t SystemData::elements(std::string_view name) const {
  const auto parts = parts_of(name);
  const Item* const found =
      parts && !parts->index && parts->member.empty() ? item(parts->name) : nullptr;
  return found == nullptr ? 0 : found->declaration.elements;
}

tl::expected<SystemData::Place, nc::Fault> SystemData::single(std::string_view name) const {
  const auto place = find(name);
  if (!place) {
    return tl::unexpected(nc::Fault{0, fmt::format("the system data {} do not exist", name)});
  }
  if (!place->element) {
    return tl::unexpected(nc::Fault{
        0, fmt::format("{} is an array or a structure: an index or a member is missing", name)});
  }
  return *place;
}

tl::expected<nc::Value, nc::Fault> SystemData::value(std::string_view name) const {
  return single(name).map([&](const Place& place) {
    return decode(*place.element, ads::BytesView(memory_).subspan(place.offset, place.size));
  });
}

tl::expected<void, nc::Fault> SystemData::assign(std::string_view name, const nc::Value& value) {
  return single(name).and_then([&](const Place& place) -> tl::expected<void, nc::Fault> {
    const auto bytes = encode(*place.element, value);
    if (!bytes) {
      return tl::unexpected(
          nc::Fault{bytes.error().id, fmt::format("{}: {}", name, bytes.error().text)});
    }
    std::copy(bytes->begin(), bytes->end(), memory_.begin() + place.offset);
    return {};
  });
}

ads::Result<ads::Bytes> SystemData::read(std::uint32_t offset, std::uint32_t room) const {
  const Item* const found = item_at(offset);
  if (found == nullptr) {
    return tl::unexpected(ads::ErrorCode::invalid_offset);
  }
  const std::uint32_t end = found->offset + found->declaration.size();
  const auto bytes = ads::BytesView(memory_).subspan(offset, std::min(room, end - offset));
  return ads::Bytes(bytes.begin(), bytes.end());
}

ads::Result<void> SystemData::write(std::uint32_t offset, ads::BytesView bytes) {
  const Item* const found = item_at(offset);
  if (found == nullptr) {
    return tl::unexpected(ads::ErrorCode::invalid_offset);
  }
  if (bytes.size() > found->offset + found->declaration.size() - offset) {
    return tl::unexpected(ads::ErrorCode::invalid_size);
  }
  std::ranges::copy(bytes, memory_.begin() + offset);
  return {};
}

}  // namespace millrace::cnc::simulator
