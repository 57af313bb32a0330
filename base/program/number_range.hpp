// Validators of numeric options with readable messages: CLI11's own validators print the greatest
// double with all of its 309 digits.
//
//   app.add_option("--rate", rate)->check(base::program::positive_number());
#pragma once

#include <CLI/App.hpp>

namespace millrace::base::program {

/// Greater than 0.
CLI::Validator positive_number();
/// 0 or greater.
CLI::Validator non_negative_number();

}  // namespace millrace::base::program
