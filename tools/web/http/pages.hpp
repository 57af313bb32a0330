// The files of the page, which are in the program: no folder has to be found, nothing is read while
// it runs.
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
  /// Of the program, compressed once.
  Pages();

  /// `path` without the '/' in front; nothing if there is no such file.
  [[nodiscard]] std::optional<Response> answer(const std::string& path,
                                               const Request& request) const;
  /// Bytes of all files, not compressed.
  [[nodiscard]] std::size_t size() const;

 private:
  struct File {
    std::string content_type;
    std::string tag;
    std::shared_ptr<const std::string> plain;
    /// Nullptr if that is not shorter.
    std::shared_ptr<const std::string> compressed;
  };
  std::map<std::string, File, std::less<>> files_;
};

/// "text/javascript; charset=utf-8" for "app.js".
std::string_view content_type_of(std::string_view path);

}  // namespace millrace::tools::web::http
