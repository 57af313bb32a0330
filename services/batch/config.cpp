#include "services/batch/config.hpp"

#include <set>

#include <fmt/format.h>

#include "base/configuration/mistakes.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/registry/identity.hpp"
#include "idl/batch.pb.h"
#include "services/sdk/service.hpp"

namespace millrace::services::batch {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

std::vector<fabric::ChannelScope> scopes(const config::Batch::Script& from) {
  std::vector<fabric::ChannelScope> scopes;
  for (const std::string& channel : from.channel()) {
    scopes.push_back(fabric::parse_channel_scope(channel).value());
  }
  return scopes;
}

Script script_from(const config::Batch::Script& from, const fs::path& folder) {
  const fs::path program = folder / from.program();
  Script script;
  script.registration = {.uuid = fabric::canonical_uuid(from.uuid()),
                         .name = from.has_name() ? from.name() : program.filename().string(),
                         .description = from.description(),
                         .delivery = from.delivery() == config::Batch::AT_LEAST_ONCE
                                         ? fabric::Delivery::at_least_once
                                         : fabric::Delivery::at_most_once,
                         .concurrency = from.concurrency(),
                         .channels = scopes(from)};
  script.program = program.lexically_normal();
  script.arguments = {from.argument().begin(), from.argument().end()};
  script.folder = (folder / from.working_folder()).lexically_normal();
  script.time_limit = std::chrono::milliseconds(from.time_limit_ms());
  script.too_long = from.too_long() == config::Batch::CUT ? TooLong::cut : TooLong::refuse;
  script.encoding = from.encoding() == config::Batch::CP1252 ? Encoding::cp1252 : Encoding::utf8;
  script.accept_empty = from.accept_empty();
  return script;
}

void check(const config::Batch::Script& script, const ConfigPath& path,
           std::set<std::string>& uuids, Mistakes& mistakes) {
  const std::string uuid = fabric::canonical_uuid(script.uuid());
  if (mistakes.expect(!uuid.empty(), path / "uuid", "is missing")) {
    mistakes.expect(uuids.insert(uuid).second, path / "uuid", script.uuid() + " occurs twice");
  }
  mistakes.expect(!script.program().empty(), path / "program", "is missing");
  mistakes.expect(script.time_limit_ms() > 0, path / "time_limit_ms", "0; expected 1 or more");
  mistakes.expect_range(script.concurrency(), 1U, sdk::max_concurrency, path / "concurrency");
  const auto expect_short = [&](const std::string& text, std::size_t most, const char* field) {
    mistakes.expect(text.size() <= most, path / field,
                    fmt::format("has {} bytes; expected at most {}", text.size(), most));
  };
  expect_short(uuid, fabric::max_text, "uuid");
  expect_short(script.name(), fabric::registry::max_identity_value, "name");
  expect_short(script.description(), fabric::registry::max_identity_value, "description");
  for (int i = 0; i < script.channel_size(); ++i) {
    const auto scope = fabric::parse_channel_scope(script.channel(i));
    mistakes.expect(scope.has_value(), path / ConfigStep{"channel", i}, scope ? "" : scope.error());
  }
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  config::Batch batch;
  base::configuration::ConfigPlaces places;
  if (const auto read = base::configuration::read_config(file, batch, places); !read) {
    return tl::unexpected(read.error());
  }
  Mistakes mistakes(batch, places);
  std::set<std::string> uuids;
  for (int i = 0; i < batch.script_size(); ++i) {
    check(batch.script(i), {{"script", i}}, uuids, mistakes);
  }
  if (!mistakes.none()) {
    return tl::unexpected(mistakes.text());
  }
  const fs::path folder = fs::absolute(file).parent_path() / batch.folder();
  Config config;
  for (const auto& script : batch.script()) {
    config.scripts.push_back(script_from(script, folder));
  }
  return config;
}

}  // namespace millrace::services::batch
