// Reads and checks the rules of mail.textproto.
#pragma once

#include <vector>

#include "base/configuration/mistakes.hpp"
#include "idl/mail.pb.h"
#include "services/mail/config.hpp"

namespace millrace::services::mail {

/// `config` has the recipients. Records every mistake with its place.
std::vector<Rule> read_rules(const config::Mail& from, const Config& config,
                             base::configuration::Mistakes& mistakes);

}  // namespace millrace::services::mail
