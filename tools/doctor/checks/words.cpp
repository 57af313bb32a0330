#include "tools/doctor/checks/words.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

}  // namespace

std::string list_of(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + safe(name);
  }
  return text;
}

std::string program_text(const Announcement& who) {
  const std::string& name = who.name.empty() ? who.process : who.name;
  return fmt::format("{}{}{}", name.empty() ? "a program" : safe(name),
                     who.host.empty() ? "" : " on " + safe(who.host),
                     who.pid.empty() ? "" : ", pid " + safe(who.pid));
}

}  // namespace millrace::tools::doctor::checks
