// Collects all mistakes of a configuration that the schema cannot detect, each with its place.
//
//   Mistakes mistakes(mail, places);
//   mistakes.expect(mail.server().port() > 0, {{"server"}, {"port"}}, "0; expected 1 to 65535");
//   if (!mistakes.none()) return tl::unexpected(mistakes.text());
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
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
  /// that the file does not have, the place is that of the next outer one.
  bool expect(bool holds, const ConfigPath& path, std::string_view what);

  /// Records a value outside `first` to `last` (NaN is outside); returns whether it is inside.
  template <typename Number>
  bool expect_range(Number value, Number first, Number last, const ConfigPath& path) {
    const bool inside = value >= first && value <= last;
    expect(inside, path, inside ? "" : fmt::format("{}; expected {} to {}", value, first, last));
    return inside;
  }

  [[nodiscard]] bool none() const { return text_.empty(); }
  /// One line for each mistake, in the order in which they were found.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  const google::protobuf::Message& config_;
  const ConfigPlaces& places_;
  std::string text_;
};

// Resolves the path of a file or folder in a configuration.

/// A relative path starts at `folder`, the folder of the configuration. A path that begins with
/// $CREDENTIALS_DIRECTORY is in the folder where systemd stores the credentials of a unit's
/// LoadCredential= (systemd.exec(5)); an error if there is none.
tl::expected<std::filesystem::path, std::string> place_of(const std::string& named,
                                                          const std::filesystem::path& folder);

}  // namespace millrace::base::configuration
