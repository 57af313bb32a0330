// The command line of the two programs: --word VALUE, in any order.
#pragma once

#include <cstdlib>
#include <iostream>
#include <map>
#include <string>

namespace millrace::tests::interop::fastdds {

class Arguments {
 public:
  /// Ends the program if a value is missing.
  Arguments(int argc, char** argv) {
    for (int i = 1; i < argc; i += 2) {
      if (i + 1 == argc) {
        std::cerr << argv[0] << ": " << argv[i] << " needs a value\n";
        std::exit(2);
      }
      values_[argv[i]] = argv[i + 1];
    }
  }

  [[nodiscard]] std::string text(const std::string& word, const std::string& otherwise) const {
    const auto found = values_.find(word);
    return found == values_.end() ? otherwise : found->second;
  }
  [[nodiscard]] int number(const std::string& word, int otherwise) const {
    return std::atoi(text(word, std::to_string(otherwise)).c_str());
  }

 private:
  std::map<std::string, std::string> values_;
};

}  // namespace millrace::tests::interop::fastdds
