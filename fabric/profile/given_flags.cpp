#include "fabric/profile/given_flags.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::fabric::profile {

std::string given_flags(const FabricFlags& flags) {
  using base::text::shell_word;
  const std::string file = flags.file();
  const dds::ParticipantOptions joined = flags.options();
  const dds::ParticipantOptions usual =
      file.empty() ? dds::ParticipantOptions{} : read_profile(file).value_or(joined);
  std::string given;
  if (!file.empty() && file != host_profile) {
    given += " --fabric-config " + shell_word(file);
  }
  if (joined.domain != usual.domain) {
    given += fmt::format(" --domain {}", joined.domain);
  }
  if (joined.fabric != usual.fabric) {
    given += " --fabric " + shell_word(joined.fabric);
  }
  return given;
}

}  // namespace millrace::fabric::profile
