// The findings and diagnoses of an examination as JSON.
#pragma once

#include <vector>

#include <boost/json/object.hpp>

#include "tools/doctor/diagnose.hpp"

namespace millrace::tools::doctor {

/// As `millrace doctor --json` prints it.
boost::json::object json_of(const Findings& found, const std::vector<Diagnosis>& diagnoses);

}  // namespace millrace::tools::doctor
