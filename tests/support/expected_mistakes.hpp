// tests/data/config/bad/PROGRAM.txt: sections with a bad configuration and what the program reports
// about it, in lines `LINE:COLUMN: the beginning of a text`.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/sections.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {

/// Writes the bad configurations of a program as files NAME.PROGRAM.textproto. Returns each file
/// with its section.
inline std::vector<std::pair<std::filesystem::path, Section>> write_bad_configurations(
    const std::string& program, const std::filesystem::path& folder) {
  std::vector<std::pair<std::filesystem::path, Section>> written;
  for (Section& section : read_sections(test_data("config/bad/" + program + ".txt"))) {
    const auto file = folder / (section.name + "." + program + ".textproto");
    std::ofstream(file, std::ios::binary) << section.text();
    written.emplace_back(file, std::move(section));
  }
  EXPECT_FALSE(written.empty()) << program;
  return written;
}

/// Expects that `error_of(FILE)` has exactly the expected lines of each bad configuration of this
/// program, in this order.
template <typename ErrorOf>
void expect_mistakes(const std::string& program, ErrorOf error_of) {
  const TemporaryFolder folder;
  for (const auto& [file, section] : write_bad_configurations(program, folder.path())) {
    std::vector<testing::Matcher<std::string>> expected;
    std::istringstream mistakes(section.text("expected"));
    for (std::string line; std::getline(mistakes, line);) {
      expected.emplace_back(testing::StartsWith(file.string() + ":" + line));
    }
    EXPECT_FALSE(expected.empty()) << section << " expects nothing";
    const std::string error = error_of(file);
    std::vector<std::string> lines;
    std::istringstream text(error);
    for (std::string line; std::getline(text, line);) {
      lines.push_back(line);
    }
    EXPECT_THAT(lines, testing::ElementsAreArray(expected)) << section << '\n' << error;
  }
}

}  // namespace millrace::tests
