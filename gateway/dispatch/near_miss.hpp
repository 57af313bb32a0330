// Why no service has a UUID, with a hint: the vendor's own NC sample misses one character of its
// service's UUID (ISG FCT-C31, Service Interface).
//
//   explain_unserved("560AACBF-6335-44a9-895A-B27F3ED5E47", known)
//   → "no service has the UUID 560AACBF-…; did you mean 560aacbf-…, one character is
//      missing; it is malformed: 35 characters, a UUID has 36"
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::gateway::dispatch {

/// The text in `known` closest to `text`, if at most four edits away.
std::optional<std::string> nearest(std::string_view text, const std::vector<std::string>& known);

/// What is wrong with a text that was meant to be a UUID, "35 characters, a UUID has 36"; empty if
/// it is a UUID, or does not resemble one.
fabric::Message malformed(std::string_view uuid);

/// The whole sentence, for a UUID as the program wrote it and the canonical UUIDs that are served.
fabric::Message explain_unserved(std::string_view uuid, const std::vector<std::string>& known);

}  // namespace millrace::gateway::dispatch
