// fabric/observer/entry.hpp for tools: a recording has the entries of an observer.
#pragma once

#include "fabric/observer/entry.hpp"

namespace millrace::tools::recording {

using fabric::observer::AlarmNews;
using fabric::observer::Change;
using fabric::observer::Entry;
using fabric::observer::InstanceNews;
using fabric::observer::Sample;
using fabric::observer::Withdrawal;

using fabric::observer::call_of;
using fabric::observer::channel_of;
using fabric::observer::is_failure;
using fabric::observer::kind_of;
using fabric::observer::machine_of;
using fabric::observer::origin_of;
using fabric::observer::text_of;
using fabric::observer::withhold_text;

}  // namespace millrace::tools::recording
