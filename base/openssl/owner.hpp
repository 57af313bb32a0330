// Owners of OpenSSL objects, and the reason of OpenSSL's last error.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

namespace millrace::base::openssl {

/// Deleter that calls one of OpenSSL's free functions.
template <auto function>
struct Free {
  template <typename T>
  void operator()(T* owned) const {
    function(owned);
  }
};

using BioOwner = std::unique_ptr<BIO, Free<BIO_free_all>>;

/// A BIO that reads from `text`, which must outlive it.
BioOwner reading(std::string_view text);
/// An empty BIO to write to; throws std::bad_alloc.
BioOwner writing();
/// The text written to a BIO.
std::string written(BIO& bio);

/// Throws std::invalid_argument, "WHAT: REASON", unless `done`.
void expect(bool done, std::string_view what);

/// Converts a time of a certificate; the epoch if there is none.
std::chrono::sys_seconds time_of(const ASN1_TIME* field);

/// The reason of the last error in this thread, such as "bad decrypt"; clears the error queue.
std::string last_reason();

}  // namespace millrace::base::openssl
