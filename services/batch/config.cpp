#include "services/batch/config.hpp"

#include <set>

#include <fmt/format.h>

#include "base/configuration/check.hpp"
#include "idl/batch.pb.h"

namespace millrace::services::batch {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::Mistakes;

Script script_from(const config::Batch::Script& from, const fs::path& folder,
                   const ConfigPath& path, Mistakes& mistakes) {
  const fs::path program = folder / from.program();
  Script script;
  script.announcement = sdk::announced(from, config::Batch::AT_LEAST_ONCE, path, mistakes);
  if (!from.has_name()) {
    script.announcement.name = program.filename().string();
  }
  script.program = program.lexically_normal();
  script.arguments = {from.argument().begin(), from.argument().end()};
  script.folder = (folder / from.working_folder()).lexically_normal();
  script.time_limit = std::chrono::milliseconds(from.time_limit_ms());
  script.too_long = from.too_long() == config::Batch::CUT ? TooLong::cut : TooLong::refuse;
  script.encoding = from.encoding() == config::Batch::CP1252 ? Encoding::cp1252 : Encoding::utf8;
  script.accept_empty = from.accept_empty();
  return script;
}

Config config_from(const config::Batch& from, const fs::path& folder, Mistakes& mistakes) {
  Config config;
  std::set<std::string> uuids;
  for (int i = 0; i < from.script_size(); ++i) {
    const config::Batch::Script& declared = from.script(i);
    const ConfigPath path{{"script", i}};
    const Script& script =
        config.scripts.emplace_back(script_from(declared, folder, path, mistakes));
    mistakes.expect(uuids.insert(script.announcement.uuid).second, path / "uuid",
                    fmt::format("\"{}\" occurs twice", declared.uuid()));
  }
  return config;
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  return base::configuration::load<config::Batch>(
      file, [&](const config::Batch& from, Mistakes& mistakes) {
        return config_from(from, fs::absolute(file).parent_path() / from.folder(), mistakes);
      });
}

}  // namespace millrace::services::batch
