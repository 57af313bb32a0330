// Any bytes as an NC program that calls itself: every finding has a place in it, and what the
// parser does not read is never silent.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "cnc/nc/channel.hpp"
#include "tools/lint/lint.hpp"

namespace {

namespace lint = millrace::tools::lint;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const lint::LintOptions options{.load = [&](const std::string& name) {
    return name == "missing" ? std::nullopt : std::optional(lint::Source{name, text});
  }};
  const lint::Report report = lint::lint(std::vector<lint::Source>{{"fuzz.nc", text}}, options);
  for (const lint::Finding& finding : report.findings) {
    require(finding.place.line >= 1 && finding.place.column >= 1 && !finding.text.empty());
  }
  require(!report.findings.empty() || millrace::cnc::nc::check("fuzz.nc", text).empty());
  return 0;
}
