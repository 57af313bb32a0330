#include "cnc/variables/family.hpp"

#include <algorithm>
#include <cctype>

namespace millrace::cnc::variables {

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
