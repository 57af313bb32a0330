// Owners of what OpenSSL allocates, and what it said last when it refused.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

namespace millrace::base::openssl {

/// Calls one of OpenSSL's functions that free something.
template <auto function>
struct Free {
  template <typename T>
  void operator()(T* owned) const {
    function(owned);
  }
};

using BioOwner = std::unique_ptr<BIO, Free<BIO_free_all>>;

/// A BIO to read `text` from, which must stay where it is meanwhile.
BioOwner reading(std::string_view text);
/// An empty BIO to write to; throws std::bad_alloc.
BioOwner writing();
/// What was written to it.
std::string written(BIO& bio);

/// Throws std::invalid_argument, "WHAT: REASON", unless it is done.
void expect(bool done, std::string_view what);

/// As a certificate has it; the epoch if there is none.
std::chrono::sys_seconds time_of(const ASN1_TIME* field);

/// The reason of the last refusal in this thread, "bad decrypt"; forgets all that is queued.
std::string last_reason();

}  // namespace millrace::base::openssl
