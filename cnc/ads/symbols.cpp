#include "cnc/ads/symbols.hpp"

#include <algorithm>

namespace millrace::cnc::ads {
namespace {

constexpr std::uint32_t handle_size = 4;
// The fixed part of a symbol entry.
constexpr std::size_t entry_size = 30;

std::uint16_t length_of(const std::string& text) {
  return static_cast<std::uint16_t>(text.size());
}

Bytes encode_handle(std::uint32_t handle, const Symbol& symbol, std::uint32_t room) {
  ByteWriter out;
  out.u32(handle);
  Bytes brief = ByteWriter(out).take();
  out.u32(symbol.size).u32(symbol.type).u16(length_of(symbol.type_name));
  out.text(symbol.type_name).u8(0);
  return out.size() <= room ? out.take() : brief;
}

Bytes encode_place(const Symbol& symbol) {
  ByteWriter out;
  return out.u32(symbol.index.group).u32(symbol.index.offset).u32(symbol.size).take();
}

Bytes encode_entry(const Symbol& symbol) {
  const auto texts = symbol.name.size() + symbol.type_name.size() + symbol.comment.size() + 3;
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(entry_size + texts));
  out.bytes(encode_place(symbol)).u32(symbol.type).u32(symbol.flags);
  out.u16(length_of(symbol.name)).u16(length_of(symbol.type_name)).u16(length_of(symbol.comment));
  out.text(symbol.name).u8(0).text(symbol.type_name).u8(0).text(symbol.comment).u8(0);
  return out.take();
}

Result<Bytes> within(std::uint32_t room, Bytes answer) {
  if (answer.size() > room) {
    return tl::make_unexpected(ErrorCode::invalid_size);
  }
  return answer;
}

bool is_upload(std::uint32_t group) {
  return group == symbol::upload || group == symbol::upload_info || group == symbol::type_upload ||
         group == symbol::upload_info_2;
}

bool is_by_name(std::uint32_t group) {
  return group == symbol::handle_by_name || group == symbol::value_by_name ||
         group == symbol::place_by_name || group == symbol::info_by_name;
}

}  // namespace

Result<Bytes> Symbols::read(std::uint16_t port, Index index, std::uint32_t length) {
  if (index.group == symbol::version) {
    return within(length, Bytes{directory_.version(port)});
  }
  if (is_upload(index.group)) {
    return within(length, upload(port, index.group));
  }
  if (index.group != symbol::value_by_handle) {
    return inner().read(port, index, length);
  }
  return symbol_of(port, index.offset).and_then([&](const Symbol& symbol) {
    return inner().read(port, symbol.index, std::min(length, symbol.size));
  });
}

Result<void> Symbols::write(std::uint16_t port, Index index, BytesView data) {
  if (index.group == symbol::value_by_handle) {
    return symbol_of(port, index.offset).and_then([&](const Symbol& symbol) {
      return inner().write(port, symbol.index, data);
    });
  }
  if (index.group == symbol::release_handle) {
    ByteReader in(data);
    const auto handle = in.u32();
    return in.exact() ? release(port, handle) : tl::make_unexpected(ErrorCode::invalid_size);
  }
  return inner().write(port, index, data);
}

Result<Bytes> Symbols::read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                                  BytesView data) {
  if (index.group == symbol::type_by_name) {
    const Structures structures = structures_of(port);
    const auto type = data_type(text_in(data), structures);
    return type ? within(read_length, encode(*type, structures))
                : tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  if (!is_by_name(index.group)) {
    return inner().read_write(port, index, read_length, data);
  }
  const auto found = directory_.find(port, text_in(data));
  if (!found) {
    return tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  switch (index.group) {
    case symbol::value_by_name:
      return inner().read(port, found->index, std::min(read_length, found->size));
    case symbol::place_by_name:
      return within(read_length, encode_place(*found));
    case symbol::info_by_name:
      return within(read_length, encode_entry(*found));
    default:
      break;
  }
  if (read_length < handle_size) {
    return tl::make_unexpected(ErrorCode::invalid_size);
  }
  return encode_handle(open(port, *found), *found, read_length);
}

Bytes Symbols::upload(std::uint16_t port, std::uint32_t group) const {
  const std::vector<Symbol> symbols = directory_.all(port);
  ByteWriter entries;
  for (const Symbol& symbol : symbols) {
    entries.bytes(encode_entry(symbol));
  }
  if (group == symbol::upload) {
    return entries.take();
  }
  ByteWriter info;
  info.u32(static_cast<std::uint32_t>(symbols.size()));
  info.u32(static_cast<std::uint32_t>(entries.size()));
  if (group == symbol::upload_info) {
    return info.take();
  }
  const std::vector<DataType> all = types(port, symbols);
  ByteWriter type_entries;
  for (const DataType& type : all) {
    type_entries.bytes(encode(type, structures_of(port)));
  }
  if (group == symbol::type_upload) {
    return type_entries.take();
  }
  info.u32(static_cast<std::uint32_t>(all.size()));
  info.u32(static_cast<std::uint32_t>(type_entries.size()));
  return info.u32(0).u32(0).take();  // no dynamic symbols
}

std::vector<DataType> Symbols::types(std::uint16_t port, const std::vector<Symbol>& symbols) const {
  std::vector<std::string> names;
  names.reserve(symbols.size());
  for (const Symbol& symbol : symbols) {
    names.push_back(symbol.type_name);
  }
  std::map<std::string, DataType> found;
  while (!names.empty()) {
    const std::string name = std::move(names.back());
    names.pop_back();
    auto type = data_type(name, structures_of(port));
    if (!type || found.contains(type->name)) {
      // A vendor's type, or one that several symbols have.
      continue;
    }
    if (!type->element_type.empty()) {
      names.push_back(type->element_type);
    }
    for (const DataItem& item : type->items) {
      names.push_back(item.type);
    }
    std::string key = type->name;
    found.emplace(std::move(key), *std::move(type));
  }
  std::vector<DataType> all;
  all.reserve(found.size());
  for (auto& [name, type] : found) {
    all.push_back(std::move(type));
  }
  return all;
}

Structures Symbols::structures_of(std::uint16_t port) const {
  return [this, port](std::string_view name) { return directory_.structure(port, name); };
}

std::uint32_t Symbols::open(std::uint16_t port, const Symbol& symbol) {
  const auto same = std::ranges::find_if(handles_, [&](const auto& entry) {
    return entry.second.port == port && entry.second.symbol.name == symbol.name;
  });
  if (same != handles_.end()) {
    ++same->second.users;
    return same->first;
  }
  handles_.emplace(next_handle_, Handle{port, symbol, 1});
  return next_handle_++;
}

Result<void> Symbols::release(std::uint16_t port, std::uint32_t handle) {
  const auto found = handles_.find(handle);
  if (found == handles_.end() || found->second.port != port) {
    return tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  if (--found->second.users == 0) {
    handles_.erase(found);
  }
  return {};
}

Result<Symbol> Symbols::symbol_of(std::uint16_t port, std::uint32_t handle) const {
  const auto found = handles_.find(handle);
  if (found == handles_.end() || found->second.port != port) {
    return tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  return found->second.symbol;
}

}  // namespace millrace::cnc::ads
