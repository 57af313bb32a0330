#include "cnc/simulator/objects/old_listing.hpp"

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "cnc/simulator/objects/answers.hpp"
#include "cnc/simulator/objects/old_value.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

template <Kind kind>
const Variable& variable_at(const VirtualChannel& channel, std::size_t index) {
  return channel.store().family(kind).listed_at(index);
}

template <Kind kind>
Listing list_family() {
  return {[](const VirtualChannel& channel) { return channel.store().family(kind).listed(); },
          variable_at<kind>,
          [](const VirtualChannel& channel, std::size_t index) {
            return variable_at<kind>(channel, index).declaration().listed();
          }};
}

/// An attribute of the variable whose index is the input.
template <typename Fact>
Object by_index(std::string_view name, std::string_view type, std::uint32_t length, Listing listing,
                Fact fact) {
  return {.name = std::string(name),
          .type = std::string(type),
          .length = length,
          .exchange = [listing, fact](const Context& at, BytesView in) {
            return decode_u32(in).and_then([&](std::uint32_t index) -> Result<Bytes> {
              if (index >= listing.size(*at.channel)) {
                return tl::unexpected(ErrorCode::invalid_data);
              }
              return fact(*at.channel, index);
            });
          }};
}

}  // namespace

Listing list_globals() {
  return list_family<Kind::global>();
}

Listing list_externals() {
  return list_family<Kind::external>();
}

Listing list_quantities() {
  return list_family<Kind::axis>();
}

Listing list_axes() {
  return {[](const VirtualChannel& channel) { return channel.axes().size(); },
          [](const VirtualChannel& channel, std::size_t index) -> const Variable& {
            return channel.store().family(Kind::axis).at(index);
          },
          [](const VirtualChannel& channel, std::size_t index) {
            return channel.axes().at(index).name;
          }};
}

Object count(std::string name, Listing listing) {
  return {.name = std::move(name),
          .type = "UNS32",
          .length = 4,
          .read = [listing](const Context& at) -> Result<Bytes> {
            return encode_u32(static_cast<std::uint32_t>(listing.size(*at.channel)));
          }};
}

Object name_by_index(std::string_view name, std::uint32_t length, Listing listing) {
  return by_index(name, "STRING", length, listing,
                  [listing, length](const VirtualChannel& channel, std::size_t index) {
                    return encode_buffer(listing.name(channel, index), length);
                  });
}

Object text_by_index(std::string_view name, std::uint32_t length, Listing listing,
                     std::string (*text)(const Declaration&)) {
  return by_index(name, "STRING", length, listing,
                  [listing, length, text](const VirtualChannel& channel, std::size_t index) {
                    return encode_buffer(text(listing.at(channel, index).declaration()), length);
                  });
}

Object number_by_index(std::string_view name, Listing listing,
                       std::uint32_t (*number)(const Declaration&)) {
  return by_index(
      name, "UNS32", 4, listing,
      [listing, number](const VirtualChannel& channel, std::size_t index) -> Result<Bytes> {
        return encode_u32(number(listing.at(channel, index).declaration()));
      });
}

Object value_by_index(std::string_view name, Listing listing) {
  return by_index(name, "EXT_VAR_WERT", old_value_size, listing,
                  [listing](const VirtualChannel& channel, std::size_t index) {
                    return read_old_value(listing.at(channel, index), Variable::scalar);
                  });
}

Object value_by_name(std::string name) {
  return {.name = std::move(name),
          .type = "EXT_VAR_WERT",
          .length = old_value_size,
          .exchange = [](const Context& at, BytesView in) {
            return decode_name(in)
                .and_then([&](std::string_view variable) { return find_variable(at, variable); })
                .and_then([](const Selection& found) -> Result<Bytes> {
                  return found.element ? read_old_value(*found.variable, *found.element)
                                       : tl::unexpected(ErrorCode::invalid_data);
                });
          }};
}

std::string type_text(const Declaration& declaration) {
  return fmt::format("V_{}", name_of(declaration.element.type));
}

}  // namespace millrace::cnc::simulator::objects
