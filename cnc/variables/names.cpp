#include "cnc/variables/names.hpp"

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

}  // namespace

std::uint32_t size_of(Type type) {
  return facts_of(type).size;
}

std::string_view name_of(Type type) {
  return facts_of(type).name;
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

std::string_view without_indices(std::string_view name) {
  while (name.ends_with(']') && name.find('[') != std::string_view::npos) {
    name = name.substr(0, name.rfind('['));
  }
  return name;
}

bool same_but_for_indices(std::string_view left, std::string_view right) {
  const auto skip = [](std::string_view& name) {
    while (name.starts_with('[')) {
      const std::size_t close = name.find(']');
      name.remove_prefix(close == std::string_view::npos ? name.size() : close + 1);
    }
  };
  for (skip(left), skip(right); !left.empty() && !right.empty(); skip(left), skip(right)) {
    if (left.front() != right.front()) {
      return false;
    }
    left.remove_prefix(1);
    right.remove_prefix(1);
  }
  return left.empty() && right.empty();
}

std::string_view family_of(std::string_view name) {
  const auto found = std::ranges::find_if(families, [&](std::string_view family) {
    if (name.size() <= family.size() || !name.starts_with(family)) {
      return false;
    }
    const auto next = static_cast<unsigned char>(name[family.size()]);
    return family == "P" ? std::isdigit(next) != 0 : next == '.';
  });
  return found == families.end() ? std::string_view() : *found;
}

}  // namespace millrace::cnc::variables
