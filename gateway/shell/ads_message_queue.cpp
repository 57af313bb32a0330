#include "gateway/shell/ads_message_queue.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/names.hpp"
#include "fabric/cases.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;
namespace messages = base::messages;
using cnc::ads::Bytes;
using cnc::ads::BytesView;
using cnc::variables::ElementType;
using cnc::variables::Type;
using tl::unexpected;

constexpr std::uint16_t port = cnc::variables::sda_port;
/// A request on the fabric holds 127 bytes, and a string of a CNC has a NUL behind them.
constexpr std::uint32_t longest_element = 128;

/// TwinCAT's number of a type (ADST_…), from a symbol.
struct NumberedType {
  std::uint32_t number;
  Type type;
};
constexpr std::array<NumberedType, 9> numbered_types{{{33, Type::boolean},
                                                      {16, Type::sgn08},
                                                      {17, Type::uns08},
                                                      {2, Type::sgn16},
                                                      {18, Type::uns16},
                                                      {3, Type::sgn32},
                                                      {19, Type::uns32},
                                                      {5, Type::real64},
                                                      {30, Type::string}}};

/// The request text of a message: a text unchanged, a number in decimal.
std::string text_of(const cnc::variables::Element& element) {
  return std::visit(fabric::Cases{[](bool value) { return std::string(value ? "TRUE" : "FALSE"); },
                                  [](std::int64_t value) { return std::to_string(value); },
                                  [](double value) { return fmt::format("{}", value); },
                                  [](const std::string& value) { return value; }},
                    element);
}

/// A whole number in the low bytes, little endian.
std::int64_t number_in(BytesView bytes, ElementType type) {
  const auto elements = cnc::variables::decode_elements(type, bytes);
  const auto* number =
      elements && !elements->empty() ? std::get_if<std::int64_t>(&elements->front()) : nullptr;
  return number == nullptr ? 0 : *number;
}

fabric::Message why_not(const cnc::ads::Result<Bytes>& answer) {
  return answer ? messages::answer_too_short()
                : fabric::Message(cnc::ads::describe(answer.error()));
}

}  // namespace

AdsMessageQueue::Found<AdsMessageQueue::Place> AdsMessageQueue::find(std::string name,
                                                                     bool single) {
  constexpr std::uint32_t longest_entry = 1024;
  const cnc::ads::Index where{cnc::ads::symbol::info_by_name, 0};
  Bytes question = cnc::variables::encode_name(name);
  const auto answer = co_await client_.read_write(port, where, longest_entry, std::move(question));
  if (!answer) {
    co_return unexpected(messages::symbol_not_read(name, cnc::ads::describe(answer.error())));
  }
  cnc::ads::ByteReader in(*answer);
  static_cast<void>(in.u32());
  Place place;
  place.index.group = in.u32();
  place.index.offset = in.u32();
  place.size = in.u32();
  const std::uint32_t number = in.u32();
  if (!in.ok()) {
    co_return unexpected(messages::symbol_too_short(name));
  }
  const auto* const type = std::ranges::find(numbered_types, number, &NumberedType::number);
  if (type != numbered_types.end()) {
    place.type = {type->type, place.size};
  } else if (single) {
    co_return unexpected(messages::symbol_is_no_message(name, number));
  }
  // Only a text's size is its own.
  if (single && place.type.type != Type::string &&
      place.size != cnc::variables::size_of(place.type.type)) {
    co_return unexpected(messages::symbol_of_other_size(name, place.size,
                                                        cnc::variables::name_of(place.type.type),
                                                        cnc::variables::size_of(place.type.type)));
  }
  co_return place;
}

AdsMessageQueue::Found<AdsMessageQueue::Layout> AdsMessageQueue::find_all() {
  Layout layout;
  std::string element_name = settings_.array + "[1]";
  auto element = co_await find(std::move(element_name), true);
  if (!element) {
    co_return unexpected(std::move(element.error()));
  }
  std::string names[] = {settings_.array, settings_.control,
                         settings_.control + "." + settings_.last_filled,
                         settings_.control + "." + settings_.last_get};
  Place* places[] = {&layout.array, &layout.control, &layout.last_filled, &layout.last_get};
  for (std::size_t i = 0; i < std::size(names); ++i) {
    const bool member = i >= 2;
    auto found = co_await find(std::move(names[i]), member);
    if (!found) {
      co_return unexpected(std::move(found.error()));
    }
    *places[i] = *found;
  }
  layout.array.type = element->type;
  if (element->size == 0 || element->size > longest_element) {
    co_return unexpected(messages::elements_too_long(element->size, longest_element));
  }
  layout.elements = layout.array.size / element->size;
  const auto inside = [&](const Place& member) {
    return member.index.group == layout.control.index.group &&
           member.index.offset >= layout.control.index.offset &&
           std::uint64_t{member.index.offset - layout.control.index.offset} + member.size <=
               layout.control.size;
  };
  const auto whole = [](const Place& member) {
    return member.type.type != Type::string && member.type.type != Type::real64 &&
           member.type.type != Type::boolean;
  };
  for (const Place& member : {layout.last_filled, layout.last_get}) {
    if (!inside(member) || !whole(member)) {
      co_return unexpected(messages::indices_not_whole(settings_.last_filled, settings_.last_get,
                                                       settings_.control));
    }
  }
  co_return layout;
}

AdsMessageQueue::Found<queues::Control> AdsMessageQueue::read_control() {
  if (!layout_) {
    auto found = co_await find_all();
    if (!found) {
      co_return unexpected(std::move(found.error()));
    }
    layout_ = *found;
  }
  const Layout layout = *layout_;
  const auto answer = co_await client_.read(port, layout.control.index, layout.control.size);
  if (!answer || answer->size() != layout.control.size) {
    // Its layout may have changed.
    layout_.reset();
    co_return unexpected(messages::symbol_not_read(settings_.control, why_not(answer)));
  }
  const auto member = [&](const Place& place) {
    const auto at = place.index.offset - layout.control.index.offset;
    return number_in(BytesView(*answer).subspan(at, place.size), place.type);
  };
  queues::Control control{member(layout.last_filled), member(layout.last_get), layout.elements};
  co_return control;
}

AdsMessageQueue::Found<std::vector<std::string>> AdsMessageQueue::read_queue() {
  if (!layout_) {
    co_return unexpected(messages::queue_not_found_yet());
  }
  const Layout layout = *layout_;
  const auto answer = co_await client_.read(port, layout.array.index, layout.array.size);
  if (!answer || answer->size() != layout.array.size) {
    layout_.reset();
    co_return unexpected(messages::queue_not_read(why_not(answer)));
  }
  std::vector<std::string> texts;
  const std::uint32_t size = layout.array.type.size;
  for (std::uint32_t i = 0; i < layout.elements; ++i) {
    const auto element = cnc::variables::decode_elements(
        layout.array.type, BytesView(*answer).subspan(std::size_t{i} * size, size));
    texts.push_back(element && !element->empty() ? text_of(element->front()) : std::string());
  }
  co_return texts;
}

AdsMessageQueue::Found<void> AdsMessageQueue::write_last_get(std::uint32_t element) {
  if (!layout_) {
    co_return unexpected(messages::queue_not_found_yet());
  }
  const Place place = layout_->last_get;
  auto bytes = cnc::variables::encode_elements(place.type, {std::to_string(element)});
  if (!bytes) {
    co_return unexpected(messages::last_get_cannot_be(element, bytes.error()));
  }
  const auto written = co_await client_.write(port, place.index, std::move(*bytes));
  if (!written) {
    co_return unexpected(messages::last_get_not_written(cnc::ads::describe(written.error())));
  }
  co_return queues::Answer<void>();
}

asio::awaitable<queues::StepAnswer> AdsMessageQueue::ask(queues::Step step) {
  if (std::holds_alternative<queues::ReadControl>(step)) {
    co_return co_await read_control();
  }
  if (std::holds_alternative<queues::ReadQueue>(step)) {
    co_return co_await read_queue();
  }
  const std::uint32_t element = std::get<queues::WriteLastGet>(step).element;
  co_return co_await write_last_get(element);
}

asio::awaitable<bool> AdsMessageQueue::watch(std::function<void()> on_event) {
  if (!layout_) {
    co_return false;
  }
  constexpr std::uint32_t cycle = 10'000;  // 1 ms in the 100 ns of the wire
  std::vector<cnc::ads::AddNotificationRequest> wanted;
  wanted.push_back(
      {layout_->control.index, layout_->control.size, cnc::ads::Transmission::on_change, 0, cycle});
  cnc::ads::NotificationHandler handler =
      [on_event = std::move(on_event)](std::size_t /*item*/, BytesView /*value*/) { on_event(); };
  const auto granted = co_await client_.subscribe(port, std::move(wanted), std::move(handler));
  co_return !granted.empty() && granted.front().has_value();
}

}  // namespace millrace::gateway::shell
