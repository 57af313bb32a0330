// Any bytes as a request: stored rows have valid, distinct keys, and refusals have an answer that
// fits.
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string>

#include "services/archiver/answering.hpp"
#include "services/text/fields.hpp"

using namespace millrace::services;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

void check(const archiver::Put& put, std::size_t size) {
  require(put.text.size() >= size);
  std::set<std::string> keys;
  for (const archiver::Field& field : put.fields) {
    require(keys.insert(field.key).second);
    require(!field.key.empty() && field.key.size() <= 32);
    for (const char c : field.key) {
      require(text::is_name_character(c));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string request(reinterpret_cast<const char*>(data), size);
  const auto put = archiver::put_of({.text = request}, {});
  if (put) {
    check(*put, size);
  } else {
    require(put.error().state == 10 && put.error().text.size() <= 127);
    require(put.error().text.find('\0') == std::string::npos);
  }
  return 0;
}
