#include "cnc/variables/type.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace millrace::cnc::variables {

namespace {

struct Facts {
  std::uint32_t size;
  std::string_view name;
};

/// In the order of Type, from boolean.
constexpr std::array<Facts, 9> facts{{
    {1, "BOOLEAN"},
    {1, "SGN08"},
    {1, "UNS08"},
    {2, "SGN16"},
    {2, "UNS16"},
    {4, "SGN32"},
    {4, "UNS32"},
    {8, "REAL64"},
    {0, "STRING"},
}};

/// The type comes from the controller, so it may be any number.
Facts facts_of(Type type) {
  const std::size_t index = static_cast<std::size_t>(type) - 1;
  return index < facts.size() ? facts.at(index) : Facts{0, "UNKNOWN"};
}

bool same(std::string_view name, std::string_view written) {
  return std::equal(name.begin(), name.end(), written.begin(), written.end(), [](char a, char b) {
    return a == std::toupper(static_cast<unsigned char>(b));
  });
}

}  // namespace

std::uint32_t size_of(Type type) {
  return facts_of(type).size;
}

std::string_view name_of(Type type) {
  return facts_of(type).name;
}

std::optional<Type> parse_type(std::string_view name) {
  const auto* const found = std::find_if(facts.begin(), facts.end(),
                                         [&](const Facts& type) { return same(type.name, name); });
  return found == facts.end()
             ? std::nullopt
             : std::optional(Type{static_cast<std::uint32_t>(found - facts.begin()) + 1});
}

std::string_view name_of(Access access) {
  switch (access) {
    case Access::read_only:
      return "READ_ONLY";
    case Access::read_write:
      return "READ_WRITE";
  }
  return "UNKNOWN";
}

}  // namespace millrace::cnc::variables
