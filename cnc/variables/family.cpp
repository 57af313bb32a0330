#include "cnc/variables/family.hpp"

#include <algorithm>
#include <cctype>

namespace millrace::cnc::variables {

std::string_view without_indices(std::string_view name) {
  return name.substr(0, name.find('['));
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
