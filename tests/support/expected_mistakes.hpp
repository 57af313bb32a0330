// A bad configuration lists its expected errors, in lines "# expect: FILE:LINE:COLUMN: …".
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tests {

/// The files of tests/data/config/bad with this ending.
inline std::vector<std::filesystem::path> bad_configurations(const std::string& data,
                                                             const std::string& ending) {
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(data + "/config/bad")) {
    if (entry.path().string().ends_with(ending)) {
      found.push_back(entry.path());
    }
  }
  EXPECT_FALSE(found.empty()) << ending;
  return found;
}

/// Expects that `error` has exactly the lines that `file` expects, in this order. An expectation is
/// the beginning of a line, from the file's name on.
inline void expect_its_mistakes(const std::filesystem::path& file, const std::string& error) {
  const std::string mark = "# expect: ";
  std::vector<testing::Matcher<std::string>> expected;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(mark)) {
      expected.emplace_back(
          testing::StartsWith(file.parent_path().string() + "/" + line.substr(mark.size())));
    }
  }
  EXPECT_FALSE(expected.empty()) << file << " expects nothing";
  std::vector<std::string> lines;
  std::istringstream text(error);
  for (std::string line; std::getline(text, line);) {
    lines.push_back(line);
  }
  EXPECT_THAT(lines, testing::ElementsAreArray(expected)) << error;
}

}  // namespace millrace::tests
