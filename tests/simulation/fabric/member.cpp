#include "tests/simulation/fabric/member.hpp"

namespace millrace::tests::simulation {

namespace {

/// An arbitrary time.
constexpr fabric::Time epoch{std::chrono::hours(24 * 365 * 55)};

}  // namespace

void Member::freeze() {
  if (!process_.awake()) {
    return;
  }
  note("is frozen");
  frozen_at_ = now();
  process_.freeze();
  fabric_.frozen(*end_);
}

void Member::thaw() {
  if (!process_.frozen()) {
    return;
  }
  note("goes on");
  process_.thaw();
  fabric_.thawed(*end_, now() - frozen_at_);
}

fabric::Time Member::wall() const {
  return epoch + now() + clock_error_;
}

}  // namespace millrace::tests::simulation
