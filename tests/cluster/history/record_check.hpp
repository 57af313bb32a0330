// Checks a scenario by its recording. Pure.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tools/recording/entry.hpp"

namespace millrace::tests::cluster {

/// One sentence for each violation, with the call; empty without violations. `ended` are the calls
/// that the gateway's journal knows as ended: a gateway that is killed between the last write of an
/// answer and the event about it does not publish it again.
///
/// I1  all writes of a call's answer have the same answer
/// I2  what is written belongs to the call that was seen last in that channel
/// I3  nothing is written for a call that its program has withdrawn
/// I5  every call that was seen is answered or withdrawn; not if its gateway was killed before it
///     dispatched the call, because the journal does not have it then: the next gateway sees the
///     request as a call of its own
/// I9  an attempt is dispatched to one instance only
std::vector<std::string> violations_recorded(const std::vector<tools::recording::Entry>& recording,
                                             const std::set<std::string>& ended);

}  // namespace millrace::tests::cluster
