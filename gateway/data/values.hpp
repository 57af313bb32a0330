// Conversion of a controller's bytes to values of the fabric, and detection of changes. Pure.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "cnc/variables/reading.hpp"
#include "fabric/data.hpp"

namespace millrace::gateway::data {

/// The type as the fabric names it.
fabric::ValueType type_of(const cnc::variables::Reading& reading);
/// The controller's response as elements; the error describes the mismatch.
tl::expected<fabric::Elements, std::string> elements_of(const cnc::variables::Reading& reading,
                                                        cnc::variables::BytesView answer);

/// Whether `now` differs from the published value `told`: another quality, reason or text, a number
/// that differs by more than `deadband`, other elements. Its time does not count.
bool is_news(const fabric::Value& told, const fabric::Value& now, double deadband);

}  // namespace millrace::gateway::data
