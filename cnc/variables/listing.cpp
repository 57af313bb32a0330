#include "cnc/variables/listing.hpp"

#include <algorithm>
#include <array>

#include "cnc/variables/names.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;
using Descriptions = std::vector<Description>;

constexpr std::array<OldListing, 4> old_listings{{
    {"P", offset::p_count, offset::p_name},
    {"V.P", offset::vp_count, offset::vp_name},
    {"V.L", offset::vl_count, offset::vl_name},
    {"V.S", offset::vs_count, offset::vs_name},
}};

asio::awaitable<Result<Descriptions>> list_old(Channel& channel, const OldListing& listing) {
  const auto count = co_await channel.old_count(listing.count);
  if (!count) {
    co_return tl::make_unexpected(count.error());
  }
  Descriptions found;
  for (std::uint32_t i = 0; i < *count; ++i) {
    auto name = co_await channel.old_name(listing.name, i);
    if (!name) {
      co_return tl::make_unexpected(name.error());
    }
    auto described = co_await channel.describe(without_indices(*name));
    found.push_back(old_description(std::move(*name), std::move(described)));
  }
  co_return found;
}

asio::awaitable<Result<Description>> look_up(Channel& channel, std::string_view name) {
  const auto variables = co_await list(channel, family_of(name));
  if (!variables) {
    co_return tl::make_unexpected(variables.error());
  }
  const auto found = std::ranges::find_if(
      *variables, [&](const Description& each) { return same_but_for_indices(each.name, name); });
  if (found == variables->end()) {
    co_return tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  co_return *found;
}

}  // namespace

const OldListing* old_listing(std::string_view family) {
  const auto* const found = std::ranges::find(old_listings, family, &OldListing::family);
  return found == old_listings.end() ? nullptr : found;
}

Description old_description(std::string name, ads::Result<Description> described) {
  if (described) {
    described->name = without_indices(name);
    return *std::move(described);
  }
  return {0, Type::real64, Access::read_write, size_of(Type::real64), {}, std::move(name)};
}

asio::awaitable<Result<Descriptions>> list(Channel& channel, std::string_view family) {
  if (const OldListing* listing = old_listing(family)) {
    auto found = co_await list_old(channel, *listing);
    co_return found;
  }
  const auto count = co_await channel.count(family);
  if (!count) {
    co_return tl::make_unexpected(count.error());
  }
  Descriptions found;
  for (std::uint32_t i = 0; i < *count; ++i) {
    const IndexStream index{i, family};
    auto description = co_await channel.describe(index);
    if (!description) {
      co_return tl::make_unexpected(description.error());
    }
    found.push_back(std::move(*description));
  }
  co_return found;
}

asio::awaitable<Result<Description>> find(Channel& channel, std::string name) {
  auto described = co_await channel.describe(without_indices(name));
  const bool too_old = !described && (described.error() == ErrorCode::invalid_offset ||
                                      described.error() == ErrorCode::service_not_supported);
  if (too_old && !family_of(name).empty()) {
    auto found = co_await look_up(channel, name);
    co_return found;
  }
  co_return described;
}

}  // namespace millrace::cnc::variables
