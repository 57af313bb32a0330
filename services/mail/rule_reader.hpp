// The rules of mail.textproto, checked.
#pragma once

#include <vector>

#include "base/configuration/mistakes.hpp"
#include "idl/mail.pb.h"
#include "services/mail/config.hpp"

namespace millrace::services::mail {

/// `config` has the recipients. Notes every mistake with its place.
std::vector<Rule> read_rules(const config::Mail& from, const Config& config,
                             base::configuration::Mistakes& mistakes);

}  // namespace millrace::services::mail
