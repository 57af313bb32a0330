#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "cnc/ads/bytes.hpp"
#include "cnc/simulator/objects/group.hpp"
#include "cnc/simulator/objects/tables.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::ErrorCode;
using ads::Result;

/// The contents of a record.
struct Entry {
  std::uint32_t offset = 0;
  std::uint32_t size = 0;
  bool writable = false;
  std::string name;
  std::string type;
};
using Entries = std::vector<Entry>;

constexpr std::size_t record_size = 84;
constexpr std::size_t text_size = 32;

std::shared_ptr<const Entries> entries_of(const ObjectTable& table) {
  auto entries = std::make_shared<Entries>();
  for (const auto& [offset, object] : table.all()) {
    entries->push_back({offset, object.length, object.write != nullptr, object.name, object.type});
  }
  return entries;
}

/// All records that one client can read, in order, made on demand.
class View {
 public:
  View(const Context& at, const Entries& cnc, const Entries& channel)
      : cnc_(cnc), channel_(channel) {
    const std::uint32_t number = at.channel == nullptr ? 0 : at.channel->number();
    with_cnc_ = number <= 1;
    first_ = number == 0 ? 1 : number;
    channels_ = number == 0 ? at.machine.settings().channels : 1;
  }

  [[nodiscard]] std::size_t size() const { return cnc_size() + channels_ * channel_.size(); }

  /// `index` counts from 0 and is smaller than size.
  void write(std::size_t index, ads::ByteWriter& out) const {
    const auto id = static_cast<std::uint32_t>(index + 1);
    if (index < cnc_size()) {
      write(cnc_.at(index), id, 0, out);
    } else {
      const std::size_t rest = index - cnc_size();
      const auto channel = first_ + static_cast<std::uint32_t>(rest / channel_.size());
      write(channel_.at(rest % channel_.size()), id, channel, out);
    }
  }

 private:
  [[nodiscard]] std::size_t cnc_size() const { return with_cnc_ ? cnc_.size() : 0; }

  static void write(const Entry& entry, std::uint32_t id, std::uint32_t channel,
                    ads::ByteWriter& out) {
    const Group group{GroupKind::com_channel, Attribute::value, channel};
    out.u32(id).u32(entry.size).u16(entry.writable ? 1 : 0).u16(0);
    out.u32(group.number()).u32(entry.offset);
    // Our own names and types are shorter than their fields.
    out.bytes(encode_buffer(entry.name, text_size).value());
    out.bytes(encode_buffer(entry.type, text_size).value());
  }

  const Entries& cnc_;
  const Entries& channel_;
  bool with_cnc_ = false;
  std::uint32_t first_ = 1;
  std::size_t channels_ = 0;
};

Result<Bytes> records(const View& view, const Context& at) {
  const std::size_t wanted = at.room / record_size;
  if (wanted == 0) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  if (at.offset > view.size()) {
    return tl::unexpected(ErrorCode::invalid_offset);
  }
  const std::size_t end = std::min(view.size(), at.offset - 1 + wanted);
  ads::ByteWriter out;
  for (std::size_t index = at.offset - 1; index < end; ++index) {
    view.write(index, out);
  }
  return out.take();
}

}  // namespace

void add_directory(ObjectTable& table, const ObjectTable& cnc, const ObjectTable& channel) {
  const auto view = [cnc = entries_of(cnc), channel = entries_of(channel)](const Context& at) {
    return View(at, *cnc, *channel);
  };
  const auto count = [view](const Context& at) { return encode_u32(view(at).size()); };
  const auto read = [view](const Context& at) { return records(view(at), at); };
  table.add(0, object("number of objects", "DWORD", "", count));
  table.add_rest({.name = "objects", .type = "RECORD", .length = record_size, .read = read});
}

}  // namespace millrace::cnc::simulator::objects
