// Compares the text of a listing with tests/data/listings, at 80 and at 120 characters.
//
//   expect_golden("channels", channels_listing(), channel_rows(plant(), plant_now));
//
// MILLRACE_WRITE_LISTINGS=1 commands_test --gtest_filter='Listing*' writes the files.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/commands/plant.hpp"
#include "tools/print/listing.hpp"

namespace millrace::tools::commands::tests {

inline void expect_golden(const std::string& name,
                          const std::function<std::string(std::size_t width)>& text_at) {
  std::string actual;
  for (const std::size_t width : {std::size_t{80}, std::size_t{120}}) {
    const std::string text = text_at(width);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_LE(print::width(line), width) << line;
    }
    actual += fmt::format("{}== {} characters\n{}", actual.empty() ? "" : "\n", width, text);
  }
  const std::filesystem::path file =
      std::filesystem::path(MILLRACE_TEST_DATA) / "listings" / (name + ".txt");
  if (std::getenv("MILLRACE_WRITE_LISTINGS") != nullptr) {
    std::ofstream(file) << actual;
  }
  std::ifstream in(file);
  const std::string expected(std::istreambuf_iterator<char>(in), {});
  EXPECT_EQ(expected, actual) << file << "\nIf the new output is right, write it with "
                              << "MILLRACE_WRITE_LISTINGS=1.";
}

template <typename Row>
void expect_golden(const std::string& name, const print::Listing<Row>& listing,
                   const std::vector<Row>& rows) {
  expect_golden(name,
                [&](std::size_t width) { return listing.text(rows, {.width = width}, plant_now); });
}

}  // namespace millrace::tools::commands::tests
