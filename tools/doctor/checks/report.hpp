// The diagnoses of the doctor, in the order in which they are found.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/doctor/diagnose.hpp"

namespace millrace::tools::doctor::checks {

class Report {
 public:
  void problem(std::string what, std::string advice) {
    said_.push_back({Severity::problem, std::move(what), std::move(advice)});
  }
  void warning(std::string what, std::string advice) {
    said_.push_back({Severity::warning, std::move(what), std::move(advice)});
  }
  void fine(std::string what) { said_.push_back({Severity::fine, std::move(what), {}}); }

  [[nodiscard]] std::size_t size() const { return said_.size(); }
  [[nodiscard]] std::vector<Diagnosis> take() && { return std::move(said_); }

 private:
  std::vector<Diagnosis> said_;
};

}  // namespace millrace::tools::doctor::checks
