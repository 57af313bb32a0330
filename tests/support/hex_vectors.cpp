#include "tests/support/hex_vectors.hpp"

#include <charconv>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>

#include "tests/support/data.hpp"

namespace millrace::tests {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Appends the bytes of one line; false for anything that is neither hex pair nor quoted text.
bool append_line(std::string_view line, Bytes& out) {
  while (true) {
    const auto start = line.find_first_not_of(" \t");
    if (start == std::string_view::npos || line[start] == '#') {
      return true;
    }
    line.remove_prefix(start);
    if (line.front() == '"') {
      const auto end = line.find('"', 1);
      if (end == std::string_view::npos) {
        return false;
      }
      out.insert(out.end(), line.begin() + 1, line.begin() + static_cast<std::ptrdiff_t>(end));
      line.remove_prefix(end + 1);
      continue;
    }
    std::uint8_t byte = 0;
    const auto pair = line.substr(0, 2);
    const auto [end, error] = std::from_chars(pair.data(), pair.data() + pair.size(), byte, 16);
    if (pair.size() != 2 || end != pair.data() + 2 || error != std::errc{}) {
      return false;
    }
    out.push_back(byte);
    line.remove_prefix(2);
  }
}

}  // namespace

HexVectors read_hex_vectors(const std::string& file) {
  std::ifstream in(test_data(file));
  if (!in) {
    throw std::runtime_error(fmt::format("{}: cannot be read", file));
  }
  HexVectors vectors;
  Bytes* current = nullptr;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.starts_with("== ")) {
      current = &vectors[line.substr(3, line.find_first_of(" #", 3) - 3)];
      continue;
    }
    Bytes ignored;
    if (!append_line(line, current != nullptr ? *current : ignored) || !ignored.empty()) {
      throw std::runtime_error(
          fmt::format("{}:{}: neither hex pairs nor quoted text", file, number));
    }
  }
  return vectors;
}

std::vector<std::uint8_t> hex_vector(const std::string& file, const std::string& name) {
  const auto vectors = read_hex_vectors(file);
  const auto found = vectors.find(name);
  if (found == vectors.end()) {
    throw std::runtime_error(fmt::format("{}: has no vector {}", file, name));
  }
  return found->second;
}

}  // namespace millrace::tests
