// The gateway's word for fabric/moment.hpp.
#pragma once

#include "fabric/moment.hpp"

namespace millrace::gateway {

using fabric::Moment;
using fabric::SteadyTime;

}  // namespace millrace::gateway
