#include "tools/web/live/examiner.hpp"

#include <utility>

#include "tools/doctor/diagnose.hpp"
#include "tools/doctor/report_json.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::live {

boost::json::object Examiner::report(std::vector<bus::LostMachine> lost) {
  if (!examined_ || std::chrono::steady_clock::now() - *examined_ > fresh) {
    examination_.lost = std::move(lost);
    const doctor::Findings found = doctor::examine(examination_);
    last_ = doctor::json_of(found, doctor::diagnose(found));
    print::put_time(last_, "time", std::chrono::system_clock::now());
    examined_ = std::chrono::steady_clock::now();
  }
  return last_;
}

}  // namespace millrace::tools::web::live
