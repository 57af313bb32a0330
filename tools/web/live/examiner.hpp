// What `millrace doctor` would say now. An examination joins the fabric for some seconds, so
// several who ask in that time get one.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include <boost/json/object.hpp>

#include "tools/doctor/examine.hpp"

namespace millrace::tools::web::live {

/// For one thread.
class Examiner {
 public:
  /// So long what was found is told again.
  static constexpr std::chrono::seconds fresh{10};

  explicit Examiner(doctor::Examination examination) : examination_(std::move(examination)) {}

  /// As `doctor --json`, with the time of the examination; blocks for its length. `lost`: machines
  /// of which the server knows that their gateways are gone.
  boost::json::object report(std::vector<bus::LostMachine> lost);

 private:
  doctor::Examination examination_;
  std::optional<std::chrono::steady_clock::time_point> examined_;
  boost::json::object last_;
};

}  // namespace millrace::tools::web::live
