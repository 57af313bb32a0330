// libcurl's handles and lists with owners, and options that cannot fail unnoticed.
//
//   const Easy handle = make_easy();
//   set(handle, CURLOPT_URL, "https://127.0.0.1/");
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <curl/curl.h>

namespace millrace::base::curl {

struct Free {
  void operator()(CURL* handle) const { curl_easy_cleanup(handle); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using Easy = std::unique_ptr<CURL, Free>;
using List = std::unique_ptr<curl_slist, Free>;

/// curl_easy_setopt takes any type and reports a mismatch by its result; a refusal is a programming
/// error.
template <typename Value>
void set(const Easy& handle, CURLoption option, Value value) {
  if (const CURLcode code = curl_easy_setopt(handle.get(), option, value); code != CURLE_OK) {
    throw std::runtime_error("libcurl refuses option " + std::to_string(option) + ": " +
                             curl_easy_strerror(code));
  }
}

/// At least 1 ms: libcurl takes 0 for none.
inline void set(const Easy& handle, CURLoption option, std::chrono::milliseconds time) {
  set(handle, option, static_cast<long>(std::max<std::int64_t>(time.count(), 1)));
}

/// Trusts only verified servers, and uses no proxy, exception or .netrc of the environment.
inline Easy make_easy() {
  Easy handle(curl_easy_init());
  if (!handle) {
    throw std::bad_alloc();
  }
  set(handle, CURLOPT_PROXY, "");
  set(handle, CURLOPT_NOPROXY, "");
  set(handle, CURLOPT_NETRC, long{CURL_NETRC_IGNORED});
  set(handle, CURLOPT_NOSIGNAL, 1L);
  set(handle, CURLOPT_SSLVERSION, long{CURL_SSLVERSION_TLSv1_2});
  set(handle, CURLOPT_SSL_VERIFYPEER, 1L);
  set(handle, CURLOPT_SSL_VERIFYHOST, 2L);
  return handle;
}

inline List list_of(const std::vector<std::string>& lines) {
  List list;
  for (const std::string& line : lines) {
    curl_slist* const longer = curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) {
      throw std::bad_alloc();
    }
    static_cast<void>(list.release());
    list.reset(longer);
  }
  return list;
}

}  // namespace millrace::base::curl
