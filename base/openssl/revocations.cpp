#include "base/openssl/revocations.hpp"

#include <fmt/format.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

namespace millrace::base::openssl {

namespace {

using TimeOwner = std::unique_ptr<ASN1_TIME, Free<ASN1_TIME_free>>;
using ListOwner = std::unique_ptr<X509_CRL, Free<X509_CRL_free>>;
using EntryOwner = std::unique_ptr<X509_REVOKED, Free<X509_REVOKED_free>>;
using NumberOwner = std::unique_ptr<BIGNUM, Free<BN_free>>;
using IntegerOwner = std::unique_ptr<ASN1_INTEGER, Free<ASN1_INTEGER_free>>;

/// Version 2 of the list, counted from 0.
constexpr long version_2 = 1;

TimeOwner asn1_of(Time time) {
  TimeOwner made(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(time)));
  expect(made != nullptr, "a list of revoked certificates cannot hold this date");
  return made;
}

void add(X509_CRL* list, const Revoked& revoked) {
  BIGNUM* parsed = nullptr;
  const int digits = BN_hex2bn(&parsed, revoked.serial.c_str());
  const NumberOwner number(parsed);
  expect(digits > 0 && digits == static_cast<int>(revoked.serial.size()),
         fmt::format("{} is no serial number", revoked.serial));
  const IntegerOwner serial(BN_to_ASN1_INTEGER(number.get(), nullptr));
  EntryOwner entry(X509_REVOKED_new());
  expect(entry && X509_REVOKED_set_serialNumber(entry.get(), serial.get()) == 1 &&
             X509_REVOKED_set_revocationDate(entry.get(), asn1_of(revoked.at).get()) == 1,
         "cannot revoke a certificate");
  expect(X509_CRL_add0_revoked(list, entry.get()) == 1, "cannot revoke a certificate");
  // The list owns it now.
  static_cast<void>(entry.release());
}

}  // namespace

std::string revocation_list(const std::vector<Revoked>& revoked, const Certificate& authority,
                            const Key& authority_key, Time from, Time until) {
  const ListOwner list(X509_CRL_new());
  expect(list != nullptr, "cannot make a list of revoked certificates");
  X509_CRL_set_version(list.get(), version_2);
  X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(authority.get()));
  X509_CRL_set1_lastUpdate(list.get(), asn1_of(from).get());
  X509_CRL_set1_nextUpdate(list.get(), asn1_of(until).get());
  for (const Revoked& one : revoked) {
    add(list.get(), one);
  }
  X509_CRL_sort(list.get());
  expect(X509_CRL_sign(list.get(), authority_key.get(), EVP_sha256()) > 0,
         "cannot sign a list of revoked certificates");
  const BioOwner out = writing();
  expect(PEM_write_bio_X509_CRL(out.get(), list.get()) == 1,
         "cannot write a list of revoked certificates");
  return written(*out);
}

tl::expected<RevocationList, std::string> RevocationList::read(std::string_view pem) {
  const BioOwner in = reading(pem);
  Owner list(PEM_read_bio_X509_CRL(
      in.get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr));
  if (!list) {
    return tl::unexpected(
        fmt::format("is no list of revoked certificates in PEM ({})", last_reason()));
  }
  return RevocationList(std::move(list));
}

bool RevocationList::is_issued_by(const Certificate& authority) const {
  const bool issued = X509_CRL_verify(list_.get(), X509_get0_pubkey(authority.get())) == 1;
  last_reason();
  return issued;
}

bool RevocationList::names(const Certificate& certificate) const {
  X509_REVOKED* entry = nullptr;
  return X509_CRL_get0_by_cert(list_.get(), &entry, certificate.get()) == 1;
}

Time RevocationList::until() const {
  return time_of(X509_CRL_get0_nextUpdate(list_.get()));
}

}  // namespace millrace::base::openssl
