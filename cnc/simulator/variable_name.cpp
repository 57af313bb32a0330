#include "cnc/simulator/variable_name.hpp"

#include <charconv>

namespace millrace::cnc::simulator {

std::optional<VariableName> VariableName::parse(std::string_view text) {
  const std::size_t open = text.find('[');
  VariableName name{text.substr(0, open), {}};
  std::string_view rest = open == std::string_view::npos ? std::string_view{} : text.substr(open);
  while (!rest.empty()) {
    const std::size_t close = rest.find(']');
    if (rest.front() != '[' || close == std::string_view::npos) {
      return std::nullopt;
    }
    std::uint32_t index = 0;
    const char* const last = rest.data() + close;
    const auto [end, error] = std::from_chars(rest.data() + 1, last, index);
    if (error != std::errc() || end != last) {
      return std::nullopt;
    }
    name.indices.push_back(index);
    rest.remove_prefix(close + 1);
  }
  if (name.base.empty()) {
    return std::nullopt;
  }
  return name;
}

}  // namespace millrace::cnc::simulator
