#include "services/batch/config.hpp"

#include <set>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "fabric/channel_scope.hpp"
#include "idl/batch.pb.h"

namespace millrace::services::batch {

namespace {

namespace fs = std::filesystem;

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
  script.kill_after = std::chrono::milliseconds(from.kill_after_ms());
  script.too_long = from.too_long() == config::Batch::CUT ? TooLong::cut : TooLong::refuse;
  script.encoding = from.encoding() == config::Batch::CP1252 ? Encoding::cp1252 : Encoding::utf8;
  script.accept_empty = from.accept_empty();
  return script;
}

/// What is wrong with one script, as words; empty if nothing.
std::string mistake(const config::Batch::Script& script, std::set<std::string>& uuids) {
  if (fabric::canonical_uuid(script.uuid()).empty()) {
    return "uuid is missing";
  }
  if (!uuids.insert(fabric::canonical_uuid(script.uuid())).second) {
    return "uuid " + script.uuid() + " is there twice";
  }
  if (script.program().empty()) {
    return "program is missing";
  }
  if (script.time_limit_ms() == 0) {
    return "time_limit_ms is 0; expected 1 or more";
  }
  if (script.concurrency() == 0) {
    return "concurrency is 0; expected 1 or more";
  }
  for (const std::string& channel : script.channel()) {
    if (const auto scope = fabric::parse_channel_scope(channel); !scope) {
      return "channel: " + scope.error();
    }
  }
  return {};
}

std::string mistakes(const config::Batch& batch, const std::string& file) {
  std::string all;
  std::set<std::string> uuids;
  for (int i = 0; i < batch.script_size(); ++i) {
    const std::string found = mistake(batch.script(i), uuids);
    if (!found.empty()) {
      all += fmt::format("{}{}: script {}: {}", all.empty() ? "" : "\n", file, i + 1, found);
    }
  }
  return all;
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  const auto batch = base::configuration::read_config<config::Batch>(file);
  if (!batch) {
    return tl::unexpected(batch.error());
  }
  const std::string wrong = mistakes(*batch, file.string());
  if (!wrong.empty()) {
    return tl::unexpected(wrong);
  }
  const fs::path folder = fs::absolute(file).parent_path() / batch->folder();
  Config config{.settle = std::chrono::milliseconds(batch->settle_ms()), .scripts = {}};
  for (const auto& script : batch->script()) {
    config.scripts.push_back(script_from(script, folder));
  }
  return config;
}

}  // namespace millrace::services::batch
