#include "tools/doctor/report_json.hpp"

#include <boost/json/array.hpp>

#include "tools/print/json.hpp"

namespace millrace::tools::doctor {

boost::json::object json_of(const Findings& found, const std::vector<Diagnosis>& diagnoses) {
  boost::json::array programs;
  for (const Program& each : found.programs) {
    programs.push_back(boost::json::object{
        {"name", print::utf8(each.name)},
        {"host", print::utf8(each.host)},
        {"pid", print::utf8(each.pid)},
        {"addresses", print::utf8(each.addresses)},
        {"fabrics", boost::json::array(each.fabrics.begin(), each.fabrics.end())},
        {"gateway", each.is_gateway},
        {"heard", !each.is_gateway || is_heard(found, each)},
        {"serves", boost::json::array(each.serves.begin(), each.serves.end())},
        {"self", each.self}});
  }
  const auto milliseconds = [](std::chrono::nanoseconds time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  boost::json::array clocks;
  for (const HostClock& each : found.clocks) {
    clocks.push_back(boost::json::object{{"host", print::utf8(each.host)},
                                         {"asked", print::utf8(each.program)},
                                         {"ahead_ms", milliseconds(each.difference.ahead)},
                                         {"error_ms", milliseconds(each.difference.error)}});
  }
  boost::json::array said;
  for (const Diagnosis& each : diagnoses) {
    said.push_back(boost::json::object{{"severity", name_of(each.severity)},
                                       {"what", print::utf8(each.what)},
                                       {"advice", print::utf8(each.advice)}});
  }
  return {
      {"healthy", is_healthy(diagnoses)},     {"fabric", print::utf8(found.joining.fabric)},
      {"domain", found.joining.domain},       {"interface", print::utf8(found.joining.interface)},
      {"multicast", found.joining.multicast}, {"programs", std::move(programs)},
      {"clocks", std::move(clocks)},          {"diagnoses", std::move(said)}};
}

}  // namespace millrace::tools::doctor
