#include "services/batch/settle.hpp"

namespace millrace::services::batch {

bool Settle::look(const std::string& state, Time now) {
  if (state != seen_) {
    seen_ = state;
    since_ = now;
  }
  if (seen_ == taken_ || now - since_ < quiet_) {
    return false;
  }
  taken_ = seen_;
  return true;
}

}  // namespace millrace::services::batch
