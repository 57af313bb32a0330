#include "cnc/simulator/variable_name.hpp"

#include <charconv>

namespace millrace::cnc::simulator {

std::optional<VariableName> VariableName::parse(std::string_view text) {
  const std::size_t open = text.find('[');
  VariableName name{std::string(text.substr(0, open)), {}, 0};
  std::string_view rest = open == std::string_view::npos ? std::string_view{} : text.substr(open);
  while (rest.starts_with('[')) {
    const std::size_t close = rest.find(']');
    if (close == std::string_view::npos) {
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
  const bool member = rest.empty() || (rest.starts_with('.') && rest.size() > 1 &&
                                       rest.find_first_of("[]") == std::string_view::npos);
  if (name.base.empty() || !member) {
    return std::nullopt;
  }
  name.base += rest;
  name.behind = rest.size();
  return name;
}

}  // namespace millrace::cnc::simulator
