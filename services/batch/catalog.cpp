#include "services/batch/catalog.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "services/sdk/file_changes.hpp"

namespace millrace::services::batch {

namespace {

const Script* find(const std::vector<Script>& scripts, const std::string& uuid) {
  const auto found = std::find_if(scripts.begin(), scripts.end(), [&](const Script& script) {
    return script.announcement.uuid == uuid;
  });
  return found == scripts.end() ? nullptr : &*found;
}

bool is_program(const std::filesystem::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
         ::access(file.c_str(), X_OK) == 0;
}

}  // namespace

Changes changes(const std::vector<Script>& before, const std::vector<Script>& after) {
  Changes changes;
  for (const Script& script : before) {
    const Script* now = find(after, script.announcement.uuid);
    if (now == nullptr || now->announcement != script.announcement) {
      changes.stop.push_back(script.announcement.uuid);
    }
  }
  for (const Script& script : after) {
    const Script* earlier = find(before, script.announcement.uuid);
    if (earlier == nullptr || earlier->announcement != script.announcement) {
      changes.start.push_back(script);
    } else if (*earlier != script) {
      changes.update.push_back(script);
    }
  }
  return changes;
}

std::vector<Script> present(const std::vector<Script>& scripts) {
  std::vector<Script> there;
  std::copy_if(scripts.begin(), scripts.end(), std::back_inserter(there),
               [](const Script& script) { return is_program(script.program); });
  return there;
}

std::vector<Script> absent(const std::vector<Script>& scripts) {
  std::vector<Script> missing;
  std::copy_if(scripts.begin(), scripts.end(), std::back_inserter(missing),
               [](const Script& script) { return !is_program(script.program); });
  return missing;
}

std::string absence_of(const Script& script) {
  return fmt::format("{}: {} is missing or not executable; {} is not served",
                     script.announcement.name, script.program.string(), script.announcement.uuid);
}

std::string fingerprint(const std::filesystem::path& config, const std::vector<Script>& scripts) {
  std::vector<std::filesystem::path> files{config};
  std::ranges::transform(scripts, std::back_inserter(files), &Script::program);
  return sdk::fingerprint(files);
}

}  // namespace millrace::services::batch
