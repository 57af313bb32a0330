#include "cnc/nc/values/functions.hpp"

#include <algorithm>

#include "cnc/nc/characters.hpp"

namespace millrace::cnc::nc::values {

bool is_string_function(const Function& function) {
  const auto table = string_functions();
  return &function >= table.data() && &function < table.data() + table.size();
}

const Function* find_function(std::string_view name) {
  for (const auto table : {number_functions(), string_functions()}) {
    const auto found = std::find_if(table.begin(), table.end(), [&](const Function& function) {
      return same_word(function.name, name);
    });
    if (found != table.end()) {
      return &*found;
    }
  }
  return nullptr;
}

}  // namespace millrace::cnc::nc::values
