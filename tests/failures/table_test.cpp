// docs/dev/failures.md and docs/dev/attacks.md name a test in each row; each of these tests must
// exist.
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace millrace::tests {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// The names in all test sources: "Suite.Name" of each test, "Class.test_name" of each in Python,
/// and each word between quotation marks.
struct Sources {
  std::set<std::string> tests;
  std::set<std::string> quoted;
};

Sources sources() {
  const std::regex declared(R"(TEST(?:_F|_P)?\((\w+),\s*(\w+)\))");
  const std::regex quoted(R"rx("(\w+)")rx");
  const std::regex python_class(R"(^class (\w+))");
  const std::regex python_test(R"(^    def (test_\w+)\()");
  Sources all;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(MILLRACE_SOURCE "/tests")) {
    if (entry.path().extension() == ".py") {
      std::istringstream lines(text_of(entry.path()));
      std::string in;
      for (std::string line; std::getline(lines, line);) {
        std::smatch found;
        if (std::regex_search(line, found, python_class)) {
          in = found.str(1);
        } else if (std::regex_search(line, found, python_test)) {
          all.tests.insert(in + "." + found.str(1));
        }
      }
    }
    if (entry.path().extension() == ".cpp") {
      const std::string text = text_of(entry.path());
      for (std::sregex_iterator it(text.begin(), text.end(), declared), end; it != end; ++it) {
        all.tests.insert(it->str(1) + "." + it->str(2));
      }
      for (std::sregex_iterator it(text.begin(), text.end(), quoted), end; it != end; ++it) {
        all.quoted.insert(it->str(1));
      }
    }
  }
  return all;
}

/// Returns the number of rows in the page's tables.
int check_tables(const std::string& page) {
  const Sources all = sources();
  std::istringstream lines(text_of(MILLRACE_SOURCE "/docs/" + page));
  const std::regex test("`([A-Za-z]+)\\.([A-Za-z0-9_]+)(?:/([A-Za-z0-9]+))?`");
  int rows = 0;
  // The last table names the check of each invariant, not a test.
  bool of_tests = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("|")) {
      of_tests = false;
      continue;
    }
    if (line.ends_with("| test |")) {
      of_tests = true;
      continue;
    }
    if (!of_tests || line.starts_with("|--")) {
      continue;
    }
    ++rows;
    // The last column.
    const std::string names = line.substr(line.rfind('|', line.size() - 2));
    int found = 0;
    for (std::sregex_iterator it(names.begin(), names.end(), test), end; it != end; ++it, ++found) {
      EXPECT_TRUE(all.tests.contains(it->str(1) + "." + it->str(2)))
          << it->str() << " in: " << line;
      if ((*it)[3].matched) {
        EXPECT_TRUE(all.quoted.contains(it->str(3))) << it->str() << " in: " << line;
      }
    }
    EXPECT_GT(found, 0) << "no test is named in: " << line;
  }
  return rows;
}

TEST(TheTableOfFailures, NamesOnlyTestsThatExist) {
  EXPECT_GT(check_tables("dev/failures.md"), 20);
}

TEST(TheTableOfAttacks, NamesOnlyTestsThatExist) {
  EXPECT_GT(check_tables("dev/attacks.md"), 14);
}

}  // namespace
}  // namespace millrace::tests
