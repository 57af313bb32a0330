#include "tools/web/http/pages.hpp"

#include <array>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>
#include <zlib.h>

#include "tools/web/http/embedded.hpp"

namespace millrace::tools::web::http {

namespace {

std::string compress(std::string_view text) {
  // zlib: 16 more for the header of gzip.
  constexpr int gzip_window = 15 + 16;
  constexpr int memory_level = 8;
  z_stream stream{};
  if (::deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, gzip_window, memory_level,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::runtime_error("the page cannot be compressed: no memory");
  }
  std::string out(::deflateBound(&stream, text.size()), '\0');
  std::string in(text);
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  ::deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  ::deflateEnd(&stream);
  return out;
}

std::string tag_of(std::string_view text) {
  const auto checksum =
      ::crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  return fmt::format("\"{:x}-{:x}\"", text.size(), checksum);
}

}  // namespace

std::string_view content_type_of(std::string_view path) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> types{{
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".json", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".webmanifest", "application/manifest+json"},
      {".txt", "text/plain; charset=utf-8"},
  }};
  for (const auto& [ending, type] : types) {
    if (path.ends_with(ending)) {
      return type;
    }
  }
  return "application/octet-stream";
}

Pages::Pages() {
  for (const EmbeddedFile& file : embedded_files()) {
    std::string compressed = compress(file.content);
    files_.emplace(
        file.path,
        File{.content_type = std::string(content_type_of(file.path)),
             .tag = tag_of(file.content),
             .plain = std::make_shared<const std::string>(file.content),
             .compressed = compressed.size() < file.content.size()
                               ? std::make_shared<const std::string>(std::move(compressed))
                               : nullptr});
  }
}

std::optional<Response> Pages::answer(const std::string& path, const Request& request) const {
  const auto found = files_.find(path.empty() ? "index.html" : path);
  if (found == files_.end()) {
    return std::nullopt;
  }
  const File& file = found->second;
  // Browsers validate the page each time, since a new version of the server has a new page.
  Response response{
      .content_type = file.content_type,
      .headers = {{"ETag", file.tag}, {"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding"}}};
  if (request.if_none_match == file.tag) {
    response.status = 304;
    return response;
  }
  if (file.compressed && request.accept_encoding.find("gzip") != std::string::npos) {
    response.body = file.compressed;
    response.headers.emplace_back("Content-Encoding", "gzip");
  } else {
    response.body = file.plain;
  }
  return response;
}

std::size_t Pages::size() const {
  return std::accumulate(
      files_.begin(), files_.end(), std::size_t{0},
      [](std::size_t sum, const auto& file) { return sum + file.second.plain->size(); });
}

}  // namespace millrace::tools::web::http
