#include "cnc/simulator/system_data_reader.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

constexpr std::size_t longest_name = 64;
constexpr std::uint32_t longest_text = 127;
constexpr std::uint32_t most_elements = 10'000;
constexpr int most_members = 100;

void check_name(const std::string& name, const ConfigPath& path, Mistakes& mistakes) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  mistakes.expect(
      !name.empty() && name.size() <= longest_name && std::ranges::all_of(name, fits),
      path / "name",
      fmt::format("\"{}\"; expected 1 to {} letters, digits and _", name, longest_name));
}

template <typename From>
ElementType element(const From& from, const ConfigPath& path, Mistakes& mistakes) {
  const bool fits = mistakes.expect_range(from.characters(), 1U, longest_text, path / "characters");
  const Type type{static_cast<std::uint32_t>(from.type())};
  return type == Type::string ? ElementType::text(fits ? from.characters() : longest_text)
                              : ElementType::number(type);
}

std::vector<DataMember> members(const config::CncSystemData& from, const ConfigPath& path,
                                Mistakes& mistakes) {
  std::vector<DataMember> all;
  std::set<std::string> names;
  mistakes.expect(
      from.member_size() <= most_members, path / "member",
      fmt::format("there are {}; expected at most {}", from.member_size(), most_members));
  for (int i = 0; i < from.member_size(); ++i) {
    const ConfigPath here = path / ConfigStep{"member", i};
    const std::string& name = from.member(i).name();
    check_name(name, here, mistakes);
    mistakes.expect(names.insert(name).second, here / "name",
                    fmt::format("there are two members {}", name));
    all.push_back({name, element(from.member(i), here, mistakes)});
  }
  return all;
}

DataDeclaration declaration(const config::CncSystemData& from, const ConfigPath& path,
                            Mistakes& mistakes) {
  check_name(from.name(), path, mistakes);
  mistakes.expect_range(from.elements(), 0U, most_elements, path / "elements");
  if (from.member_size() > 0) {
    mistakes.expect(
        !from.has_type() && !from.has_value(), path,
        fmt::format("{} has members, and a type or a value; expected one of them", from.name()));
    return {from.name(), members(from, path, mistakes), from.elements()};
  }
  DataDeclaration single{from.name(), {{"", element(from, path, mistakes)}}, from.elements()};
  const ElementType type = single.members.front().element;
  const auto value = from.has_value() ? value_of(type, from.value()) : std::optional(zero_of(type));
  mistakes.expect(value.has_value(), path / "value",
                  fmt::format("\"{}\" is not a {}", from.value(), name_of(type.type)));
  single.value = value.value_or(zero_of(type));
  return single;
}

}  // namespace

std::vector<DataDeclaration> read_system_data(const config::Cnc& config, Mistakes& mistakes) {
  std::vector<DataDeclaration> all;
  std::set<std::string> names;
  for (int i = 0; i < config.system_data_size(); ++i) {
    const ConfigPath path{{"system_data", i}};
    all.push_back(declaration(config.system_data(i), path, mistakes));
    mistakes.expect(names.insert(all.back().name).second, path / "name",
                    fmt::format("there are two of {}", all.back().name));
  }
  return all;
}

}  // namespace millrace::cnc::simulator
