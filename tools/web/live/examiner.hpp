// The present findings of `millrace doctor`. An examination joins the fabric for some seconds;
// readers who ask in that time share it.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include <boost/json/object.hpp>

#include "tools/doctor/examine.hpp"

namespace millrace::tools::web::live {

/// Not thread-safe.
class Examiner {
 public:
  /// A report is used again for so long.
  static constexpr std::chrono::seconds fresh{10};

  explicit Examiner(doctor::Examination examination) : examination_(std::move(examination)) {}

  /// As `doctor --json`, with the time of the examination; blocks for its length. `lost`: machines
  /// whose gateways the server knows to be gone.
  boost::json::object report(std::vector<bus::LostMachine> lost);

 private:
  doctor::Examination examination_;
  std::optional<std::chrono::steady_clock::time_point> examined_;
  boost::json::object last_;
};

}  // namespace millrace::tools::web::live
