// Values between the bytes of a controller and the fabric, and when one is another than before.
// Pure.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "cnc/variables/reading.hpp"
#include "fabric/data.hpp"

namespace millrace::gateway::data {

/// The type as the fabric names it.
fabric::ValueType type_of(const cnc::variables::Reading& reading);
/// What the controller answered; the error says what does not fit.
tl::expected<fabric::Elements, std::string> elements_of(const cnc::variables::Reading& reading,
                                                        cnc::variables::BytesView answer);

/// Whether `now` is news for who knows `told`: another quality or reason, another text, a number
/// that differs by more than `deadband`, other elements. Its time is no news.
bool is_news(const fabric::Value& told, const fabric::Value& now, double deadband);

}  // namespace millrace::gateway::data
