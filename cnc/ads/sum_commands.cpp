#include "cnc/ads/sum_commands.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace millrace::cnc::ads {
namespace {

struct Item {
  Index index;
  std::uint32_t read_length = 0;
  std::uint32_t write_length = 0;
};

// The layout of the items of a sum command, and of its response.
struct Form {
  bool reads = false;
  bool writes = false;
  // Each result is followed by the length that was returned.
  bool lengths = false;
  // Data has slots of the requested length; otherwise it is packed.
  bool slots = false;
};

std::optional<Form> form_of(std::uint32_t group) {
  switch (group) {
    case sum::read:
      return Form{.reads = true, .slots = true};
    case sum::write:
      return Form{.writes = true};
    case sum::read_write:
      return Form{.reads = true, .writes = true, .lengths = true};
    case sum::read_with_lengths:
      return Form{.reads = true, .lengths = true, .slots = true};
    case sum::read_packed:
      return Form{.reads = true, .lengths = true};
    default:
      return std::nullopt;
  }
}

std::size_t item_size(const Form& form) {
  return form.reads && form.writes ? 16 : 12;
}

std::vector<Item> parse_items(ByteReader& in, const Form& form, std::size_t count) {
  std::vector<Item> items;
  items.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Item item;
    item.index.group = in.u32();
    item.index.offset = in.u32();
    item.read_length = form.reads ? in.u32() : 0;
    item.write_length = form.writes ? in.u32() : 0;
    items.push_back(item);
  }
  return items;
}

std::uint64_t total(const std::vector<Item>& items, std::uint32_t Item::*length) {
  std::uint64_t bytes = 0;
  for (const auto& item : items) {
    bytes += item.*length;
  }
  return bytes;
}

struct SumRequest {
  std::vector<Item> items;
  // The data to write, item after item.
  BytesView data;
  bool with_results = true;
  // The most bytes of data in the response.
  std::size_t room = 0;
};

// Checks every length before the first item, so that a malformed sum executes no item.
Result<SumRequest> parse_sum(const Form& form, Index index, std::size_t limit, BytesView data) {
  const auto invalid = tl::make_unexpected(ErrorCode::invalid_size);
  SumRequest request;
  // Recorded from a TwinCAT: a plain sum read with offset 0 has as many items as its data holds,
  // and no results in its response.
  request.with_results = index.offset != 0 || index.group != sum::read;
  const auto most = data.size() / item_size(form);
  const std::size_t count = request.with_results ? index.offset : most;
  const std::size_t results = request.with_results ? count * (form.lengths ? 8 : 4) : 0;
  if (count > most || results > limit) {
    return invalid;
  }
  ByteReader in(data);
  request.items = parse_items(in, form, count);
  request.data = in.rest();
  request.room = limit - results;
  if (request.data.size() != total(request.items, &Item::write_length) ||
      (form.slots && total(request.items, &Item::read_length) > request.room)) {
    return invalid;
  }
  return request;
}

// Both parts of the response grow side by side and are joined at the end.
class SumAnswer {
 public:
  SumAnswer(const Form& form, std::size_t room) : form_(form), room_(room) {}

  // The most bytes that the next item may return.
  [[nodiscard]] std::uint32_t bound(const Item& item) const {
    const auto left = room_ - data_.size();
    return static_cast<std::uint32_t>(std::min<std::size_t>(item.read_length, left));
  }
  void add(const Item& item, const Result<Bytes>& result) {
    const auto code = result ? ErrorCode::none : result.error();
    const std::size_t size = result ? result->size() : 0;
    results_.u32(static_cast<std::uint32_t>(code));
    if (form_.lengths) {
      results_.u32(static_cast<std::uint32_t>(size));
    }
    if (result) {
      data_.bytes(*result);
    }
    if (form_.slots) {
      data_.zeros(item.read_length - size);
    }
  }
  Bytes take(bool with_results) {
    return with_results ? results_.bytes(data_.take()).take() : data_.take();
  }

 private:
  Form form_;
  std::size_t room_;
  ByteWriter results_;
  ByteWriter data_;
};

Result<Bytes> execute(Device& device, std::uint16_t port, const Form& form, const Item& item,
                      std::uint32_t bound, BytesView data) {
  if (!form.writes) {
    return device.read(port, item.index, bound);
  }
  if (form.reads) {
    return device.read_write(port, item.index, bound, data);
  }
  return device.write(port, item.index, data).map([] { return Bytes{}; });
}

}  // namespace

struct SumWork::State {
  State(Device& the_device, std::uint16_t the_port, const Form& the_form, BytesView the_data)
      : device(the_device),
        port(the_port),
        form(the_form),
        data(the_data.begin(), the_data.end()) {}

  Device& device;
  std::uint16_t port;
  Form form;
  /// The data that the request refers to.
  Bytes data;
  SumRequest request{};
  std::optional<SumAnswer> answer{};
  std::optional<ByteReader> written{};
  std::size_t next = 0;
};

SumWork::SumWork(std::unique_ptr<State> state) : state_(std::move(state)) {}
SumWork::~SumWork() = default;
SumWork::SumWork(SumWork&&) noexcept = default;
SumWork& SumWork::operator=(SumWork&&) noexcept = default;

bool SumWork::step(std::size_t items) {
  const auto& all = state_->request.items;
  const auto end = std::min(all.size(), state_->next + std::min(items, all.size()));
  for (; state_->next < end; ++state_->next) {
    const Item& item = all[state_->next];
    const auto bytes = state_->written->take(item.write_length);
    const auto bound = state_->answer->bound(item);
    state_->answer->add(item,
                        execute(state_->device, state_->port, state_->form, item, bound, bytes));
  }
  return state_->next == all.size();
}

Bytes SumWork::take() {
  return state_->answer->take(state_->request.with_results);
}

Result<std::optional<SumWork>> SumCommands::begin(std::uint16_t port, Index index,
                                                  std::uint32_t read_length, BytesView data) {
  const auto form = form_of(index.group);
  if (!form) {
    return std::optional<SumWork>();
  }
  auto state = std::make_unique<SumWork::State>(inner(), port, *form, data);
  const auto limit = std::min<std::size_t>(read_length, max_answer_);
  auto request = parse_sum(*form, index, limit, state->data);
  if (!request) {
    return tl::make_unexpected(request.error());
  }
  state->request = std::move(*request);
  state->answer.emplace(*form, state->request.room);
  state->written.emplace(state->request.data);
  return std::optional<SumWork>(std::move(state));
}

Result<Bytes> SumCommands::read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                                      BytesView data) {
  auto work = begin(port, index, read_length, data);
  if (!work) {
    return tl::make_unexpected(work.error());
  }
  if (!*work) {
    return inner().read_write(port, index, read_length, data);
  }
  static_cast<void>((*work)->step(data.size()));
  return (*work)->take();
}

}  // namespace millrace::cnc::ads
