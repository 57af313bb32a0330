// Collects all mistakes of a configuration, each with its place.
//
//   mistakes.expect(mail.rule_size() > 0, {{"rule"}}, "is missing; expected one or more");
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/message.h>
#include <tl/expected.hpp>

#include "base/configuration/config_file.hpp"

namespace millrace::base::configuration {

using ConfigStep = ConfigPlaces::Step;
/// The fields from the outermost to the one in question.
using ConfigPath = std::vector<ConfigStep>;

/// `path` with one more step.
ConfigPath operator/(ConfigPath path, ConfigStep step);
ConfigPath operator/(ConfigPath path, std::string field);

/// All processes use this collector. Both constructor arguments must outlive it.
class Mistakes {
 public:
  Mistakes(const google::protobuf::Message& config, const ConfigPlaces& places)
      : config_(config), places_(places) {}

  /// Records "FILE:LINE:COLUMN: FIELD.FIELD: WHAT" unless `holds`; returns `holds`. For a field
  /// that the file does not have, the place is that of the next outer one. Control characters in
  /// WHAT are escaped. Only the first mistake
  /// of a field counts: others follow from it.
  bool expect(bool holds, const ConfigPath& path, std::string_view what);

  /// Records a value outside `first` to `last` (NaN is outside); returns whether it is inside.
  template <typename Number>
  bool expect_range(Number value, Number first, Number last, const ConfigPath& path) {
    const bool inside = value >= first && value <= last;
    expect(inside, path, inside ? "" : fmt::format("{}; expected {} to {}", value, first, last));
    return inside;
  }

  /// The value of `parsed`; otherwise an empty one, and records the error.
  template <typename Value>
  Value take(tl::expected<Value, std::string> parsed, const ConfigPath& path) {
    expect(parsed.has_value(), path, parsed ? "" : parsed.error());
    return std::move(parsed).value_or(Value{});
  }

  [[nodiscard]] bool none() const { return lines_.empty(); }
  /// One line for each mistake, in the order of the file.
  [[nodiscard]] std::string text() const;

 private:
  const google::protobuf::Message& config_;
  const ConfigPlaces& places_;
  std::set<std::string> wrong_fields_;
  /// By line and column.
  std::multimap<std::pair<int, int>, std::string> lines_;
};

// Resolves the path of a file or folder in a configuration.

/// A relative path starts at `folder`, the folder of the configuration. A path that begins with
/// $CREDENTIALS_DIRECTORY is in the folder where systemd stores the credentials of a unit's
/// LoadCredential= (systemd.exec(5)); an error if there is none.
tl::expected<std::filesystem::path, std::string> place_of(const std::string& named,
                                                          const std::filesystem::path& folder);

}  // namespace millrace::base::configuration
