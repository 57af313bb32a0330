// The files of the page. They are embedded in the executable, so the server needs no folder and
// reads no file while it runs.
//
//   const Pages pages;
//   pages.answer("app.js", request)
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::http {

class Pages {
 public:
  /// Loads and compresses the embedded files.
  Pages();

  /// `path` without the leading '/'; nothing if there is no such file.
  [[nodiscard]] std::optional<Response> answer(const std::string& path,
                                               const Request& request) const;
  /// Total size of all files, uncompressed.
  [[nodiscard]] std::size_t size() const;

 private:
  struct File {
    std::string content_type;
    std::string tag;
    std::shared_ptr<const std::string> plain;
    /// Nullptr if compression does not make it shorter.
    std::shared_ptr<const std::string> compressed;
  };
  std::map<std::string, File, std::less<>> files_;
};

/// "text/javascript; charset=utf-8" for "app.js".
std::string_view content_type_of(std::string_view path);

}  // namespace millrace::tools::web::http
