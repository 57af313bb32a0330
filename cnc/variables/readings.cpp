#include "cnc/variables/readings.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "cnc/variables/names.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

namespace {

/// The index group of COM's objects, with the bits that select its directory.
constexpr std::uint32_t directory_group = 0x130100;

/// All records of a channel's directory (IB/tf5200_ads_access_to_cnc/855973643, documented); the
/// directory of channel 1 also has the controller's objects. Errors are those of the controller or
/// the client, and protocol_error for a directory of more than 10,000 records.
asio::awaitable<Result<std::vector<DirectoryEntry>>> read_directory(ads::Client& client,
                                                                    std::uint32_t channel) {
  constexpr std::uint32_t most = 10'000;
  constexpr std::uint32_t at_once = 32;
  const std::uint32_t group = directory_group + channel;
  const ads::Index head{group, 0};
  const auto answer = co_await client.read(com_port, head, 4);
  const auto counted = answer.and_then(decode_number);
  if (!counted || *counted > most) {
    co_return tl::make_unexpected(counted ? ErrorCode::protocol_error : counted.error());
  }
  const std::uint32_t count = *counted;
  std::vector<DirectoryEntry> entries;
  while (entries.size() < count) {
    const auto next = static_cast<std::uint32_t>(entries.size());
    const ads::Index place{group, next + 1};
    const auto length =
        static_cast<std::uint32_t>(std::min(at_once, count - next) * directory_record);
    const auto records = co_await client.read(com_port, place, length);
    if (!records) {
      co_return tl::make_unexpected(records.error());
    }
    BytesView rest(*records);
    if (rest.size() < directory_record) {
      co_return tl::make_unexpected(ErrorCode::protocol_error);
    }
    while (const auto entry = decode_directory_record(rest)) {
      entries.push_back(*entry);
      rest = rest.subspan(directory_record);
    }
  }
  co_return entries;
}

/// The offsets of the old functions that list the variables of NC programs (addresses.hpp).
struct OldListing {
  std::string_view family;
  std::uint32_t count = 0;
  std::uint32_t name = 0;
};

constexpr std::array<OldListing, 4> old_listings{{
    {"P", offset::p_count, offset::p_name},
    {"V.P", offset::vp_count, offset::vp_name},
    {"V.L", offset::vl_count, offset::vl_name},
    {"V.S", offset::vs_count, offset::vs_name},
}};

/// The functions of a family; null if it is listed in another way.
const OldListing* old_listing(std::string_view family) {
  const auto* const found = std::ranges::find(old_listings, family, &OldListing::family);
  return found == old_listings.end() ? nullptr : found;
}

/// The description of a variable from the old functions, whose name for an array has its largest
/// index. `described` is the controller's description of the name without that index. Controllers
/// that cannot describe by name give REAL64 and READ_WRITE (documented for the old functions).
Description old_description(std::string name, Result<Description> described) {
  if (described) {
    described->name = without_indices(name);
    return *std::move(described);
  }
  return {0, Type::real64, Access::read_write, size_of(Type::real64), {}, std::move(name)};
}

using Known = Readings::Known;

bool has_indices(std::string_view name) {
  return name.find('[') != std::string_view::npos;
}

/// The controller is too old to describe by name (documented for 0x4C), or to give handles.
bool too_old(ErrorCode code) {
  return code == ErrorCode::invalid_offset || code == ErrorCode::service_not_supported;
}

tl::unexpected<LookupError> trouble(ErrorCode code) {
  return tl::unexpected(LookupError{code, ads::describe(code)});
}

tl::unexpected<LookupError> trouble(std::string reason) {
  return tl::unexpected(LookupError{ErrorCode::invalid_data, std::move(reason)});
}

Result<Description> description_of(const Result<Bytes>& answer) {
  return answer.and_then([](const Bytes& bytes) -> Result<Description> {
    auto description = decode_description(bytes);
    return description ? Result<Description>(std::move(*description))
                       : tl::make_unexpected(ErrorCode::protocol_error);
  });
}

/// In bytes: the longest description with its name, and the longest name of the old functions.
constexpr std::uint32_t described_length = 512;
constexpr std::uint32_t old_name_length = 96;

/// In bytes: five numbers, and one for each dimension.
constexpr std::uint32_t nameless_length = 64;

}  // namespace

bool is_object_name(std::string_view name) {
  return is_com_name(name) || find_geo_object(name, 1).has_value();
}

Reading Readings::question(std::uint16_t channel, std::uint32_t offset, std::uint32_t length,
                           Bytes input) const {
  Reading reading;
  reading.port = location_.port;
  reading.index = {location_.group + channel, offset};
  reading.length = length;
  reading.input = std::move(input);
  return reading;
}

asio::awaitable<std::vector<Known>> Readings::look_up(std::uint16_t channel,
                                                      std::vector<std::string> names) {
  std::vector<Known> all;
  std::vector<std::string> variables;
  for (const std::string& name : names) {
    if (!is_object_name(name)) {
      variables.push_back(name);
    }
  }
  const auto described = co_await describe(channel, variables);
  std::vector<Known> known;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    if (!described[i]) {
      known.emplace_back(trouble(described[i].error()));
      continue;
    }
    const auto type = element_type(*described[i]);
    if (!type) {
      known.emplace_back(trouble(type.error()));
      continue;
    }
    const bool indexed = has_indices(variables[i]);
    const std::uint32_t whole =
        std::min(std::max(described[i]->size, type->size), std::uint32_t{max_stream});
    Reading reading = question(channel, offset::read_by_name, indexed ? type->size : whole,
                               encode_name(variables[i]));
    reading.type = *type;
    reading.is_array = !indexed && !described[i]->dimensions.empty();
    reading.access = described[i]->access;
    reading.size = described[i]->size;
    reading.dimensions = described[i]->dimensions;
    known.emplace_back(std::move(reading));
  }
  co_await use_handles(channel, variables, known);
  auto next = known.begin();
  for (const std::string& name : names) {
    if (is_object_name(name)) {
      auto object = co_await find_object(channel, name);
      all.push_back(std::move(object));
    } else {
      all.push_back(std::move(*next++));
    }
  }
  co_return all;
}

asio::awaitable<std::vector<Result<Description>>> Readings::describe(
    std::uint16_t channel, std::vector<std::string> names) {
  const auto answers = co_await ask(questions_for(channel, names));
  std::vector<Result<Description>> descriptions;
  for (std::size_t i = 0; i < names.size(); ++i) {
    auto description = description_of(answers[i]);
    if (!description && too_old(description.error()) && !family_of(names[i]).empty()) {
      description = co_await describe_from_list(channel, names[i]);
    }
    descriptions.push_back(std::move(description));
  }
  co_return descriptions;
}

std::vector<Reading> Readings::questions_for(std::uint16_t channel,
                                             const std::vector<std::string>& names) const {
  std::vector<Reading> questions;
  questions.reserve(names.size());
  for (const std::string& name : names) {
    questions.push_back(question(channel, offset::description_by_name, nameless_length,
                                 encode_name(without_indices(name))));
  }
  return questions;
}

asio::awaitable<Result<Description>> Readings::describe_from_list(std::uint16_t channel,
                                                                  std::string name) {
  const std::pair place{channel, std::string(family_of(name))};
  auto listing = listings_.find(place);
  if (listing == listings_.end()) {
    auto variables = co_await list(channel, place.second);
    if (!variables) {
      co_return tl::make_unexpected(variables.error());
    }
    listing = listings_.insert_or_assign(place, std::move(*variables)).first;
  }
  const auto found = std::ranges::find_if(listing->second, [&](const Description& each) {
    return same_but_for_indices(each.name, name);
  });
  if (found == listing->second.end()) {
    // NC programs create variables: the next lookup lists the family again.
    listings_.erase(listing);
    co_return tl::make_unexpected(ErrorCode::symbol_not_found);
  }
  co_return *found;
}

/// Uses handles only for variables of the kernel, its configuration and its axes. The variables of
/// NC programs are read by name (ISG/312791435, documented).
asio::awaitable<void> Readings::use_handles(std::uint16_t channel, std::vector<std::string> names,
                                            std::vector<Known>& known) {
  if (without_handles_.contains(channel)) {
    co_return;
  }
  std::vector<std::size_t> wanted;
  std::vector<Reading> questions;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string_view family = family_of(names[i]);
    const bool fixed = family == "V.G" || family == "V.E" || family == "V.A";
    if (known[i] && fixed && !has_indices(names[i])) {
      wanted.push_back(i);
      questions.push_back(question(channel, offset::handle_by_name, 4, encode_name(names[i])));
    }
  }
  const auto answers = co_await ask(std::move(questions));
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto handle = answers[i].and_then(decode_number);
    if (handle) {
      Reading& reading = *known[wanted[i]];
      reading.index.offset = offset::read_by_handle;
      reading.input = encode(ElementOf{*handle, {}});
    } else if (too_old(handle.error())) {
      without_handles_.insert(channel);
    }
  }
}

asio::awaitable<Known> Readings::find_object(std::uint16_t channel, std::string name) {
  if (const auto place = find_geo_object(name, channel)) {
    Reading reading;
    reading.port = place->port;
    reading.index = place->index;
    reading.length = place->type.size;
    reading.size = place->type.size;
    reading.type = place->type;
    co_return reading;
  }
  const std::uint16_t of = name.starts_with("cnc_") ? 1 : channel;
  auto directory = directories_.find(of);
  if (directory == directories_.end()) {
    auto entries = co_await read_directory(client_, of);
    ++requests_;
    if (!entries) {
      co_return trouble(entries.error());
    }
    directory = directories_.insert_or_assign(of, std::move(*entries)).first;
  }
  const auto found = std::ranges::find(directory->second, name, &DirectoryEntry::name);
  if (found == directory->second.end()) {
    co_return trouble(
        fmt::format("the controller's directory of channel {} does not list {}", of, name));
  }
  const auto type = element_type(*found);
  if (!type) {
    co_return trouble(type.error());
  }
  Reading reading;
  reading.port = com_port;
  reading.index = found->index;
  reading.length = found->size;
  reading.size = found->size;
  reading.type = *type;
  reading.access = found->writable ? Access::read_write : Access::read_only;
  co_return reading;
}

asio::awaitable<Result<Readings::Page>> Readings::list_page(std::uint16_t channel,
                                                            std::string family, std::uint32_t first,
                                                            std::uint32_t most) {
  const OldListing* const old = old_listing(family);
  std::vector<Reading> how_many;
  if (old != nullptr) {
    how_many.push_back(question(channel, old->count, 4, {}));
  } else {
    how_many.push_back(question(channel, offset::count, 4, encode_name(family)));
  }
  const auto counted = co_await ask(std::move(how_many));
  const auto total = counted.front().and_then(decode_number);
  if (!total) {
    co_return tl::make_unexpected(total.error());
  }
  Page page{*total, {}};
  std::vector<Reading> questions;
  for (std::uint32_t i = first; i < *total && i - first < most; ++i) {
    questions.push_back(
        old != nullptr
            ? question(channel, old->name, old_name_length, ads::ByteWriter().u32(i).take())
            : question(channel, offset::description_by_index, described_length,
                       encode(IndexStream{i, family})));
  }
  const auto answers = co_await ask(std::move(questions));
  std::vector<std::string> names;
  for (const Result<Bytes>& answer : answers) {
    if (!answer) {
      co_return tl::make_unexpected(answer.error());
    }
    if (old != nullptr) {
      names.push_back(decode_text(*answer));
      continue;
    }
    auto description = description_of(answer);
    if (!description) {
      co_return tl::make_unexpected(description.error());
    }
    page.variables.push_back(std::move(*description));
  }
  const auto described = co_await ask(questions_for(channel, names));
  for (std::size_t i = 0; i < names.size(); ++i) {
    page.variables.push_back(old_description(std::move(names[i]), description_of(described[i])));
  }
  co_return page;
}

asio::awaitable<Result<std::vector<Description>>> Readings::list(std::uint16_t channel,
                                                                 std::string family) {
  constexpr std::uint32_t at_once = 100;
  auto page = co_await list_page(channel, family, 0, at_once);
  std::vector<Description> all;
  while (page) {
    std::ranges::move(page->variables, std::back_inserter(all));
    const auto known = static_cast<std::uint32_t>(all.size());
    if (page->variables.empty() || known >= page->total) {
      co_return all;
    }
    page = co_await list_page(channel, family, known, at_once);
  }
  co_return tl::make_unexpected(page.error());
}

asio::awaitable<Answers> Readings::read(std::vector<Reading> readings) {
  auto answers = co_await ask(std::move(readings));
  co_return answers;
}

asio::awaitable<Answers> Readings::ask(std::vector<Reading> readings) {
  if (readings.size() > 1 && sums(readings.front().port)) {
    auto answers = co_await ask_in_a_sum(readings);
    if (sums(readings.front().port)) {
      co_return answers;
    }
  }
  Answers answers;
  for (const Reading& reading : readings) {
    auto answer = co_await ask_one(reading);
    answers.push_back(std::move(answer));
  }
  co_return answers;
}

/// If the controller refuses the whole request, the port is remembered as one without sums.
asio::awaitable<Answers> Readings::ask_in_a_sum(std::vector<Reading> readings) {
  const std::uint16_t port = readings.front().port;
  const auto kind = port == location_.port ? ads::SumOf::read_writes : ads::SumOf::reads;
  std::vector<ads::SumItem> items;
  items.reserve(readings.size());
  for (Reading& reading : readings) {
    items.push_back({reading.index, reading.length, std::move(reading.input)});
  }
  ++requests_;
  auto answers = co_await read_together(client_, port, std::move(items), kind);
  if (answers) {
    co_return std::move(*answers);
  }
  if (ads::refuses_sums(answers.error())) {
    without_sums_.insert(port);
  }
  co_return Answers(readings.size(), tl::make_unexpected(answers.error()));
}

asio::awaitable<Result<Bytes>> Readings::ask_one(Reading reading) {
  ++requests_;
  if (reading.input.empty()) {
    auto answer = co_await client_.read(reading.port, reading.index, reading.length);
    co_return answer;
  }
  auto answer = co_await client_.read_write(reading.port, reading.index, reading.length,
                                            std::move(reading.input));
  co_return answer;
}

}  // namespace millrace::cnc::variables
