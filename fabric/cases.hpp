// One function for each relevant alternative of a variant, and one for all others.
//
//   std::visit(Cases{[](const Give& give) { … }, [](const auto&) {}}, decision);
#pragma once

namespace millrace::fabric {

template <typename... Functions>
struct Cases : Functions... {
  using Functions::operator()...;
};
template <typename... Functions>
Cases(Functions...) -> Cases<Functions...>;

}  // namespace millrace::fabric
