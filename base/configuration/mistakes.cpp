#include "base/configuration/mistakes.hpp"

namespace millrace::base::configuration {

ConfigPath operator/(ConfigPath path, ConfigStep step) {
  path.push_back(std::move(step));
  return path;
}

ConfigPath operator/(ConfigPath path, std::string field) {
  return std::move(path) / ConfigStep{std::move(field)};
}

bool Mistakes::expect(bool holds, const ConfigPath& path, std::string_view what) {
  if (!holds) {
    std::string field;
    for (const ConfigStep& step : path) {
      field += (field.empty() ? "" : ".") + step.field;
    }
    text_ += fmt::format("{}{}: {}{}{}", text_.empty() ? "" : "\n", places_.at(config_, path),
                         field, field.empty() ? "" : ": ", what);
  }
  return holds;
}

}  // namespace millrace::base::configuration
