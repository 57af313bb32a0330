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
using StringOwner = std::unique_ptr<ASN1_UTF8STRING, Free<ASN1_UTF8STRING_free>>;
using OctetsOwner = std::unique_ptr<ASN1_OCTET_STRING, Free<ASN1_OCTET_STRING_free>>;
using ExtensionOwner = std::unique_ptr<X509_EXTENSION, Free<X509_EXTENSION_free>>;
struct FreeBytes {
  void operator()(unsigned char* bytes) const { OPENSSL_free(bytes); }
};
using BytesOwner = std::unique_ptr<unsigned char, FreeBytes>;
using IntegerOwner = std::unique_ptr<ASN1_INTEGER, Free<ASN1_INTEGER_free>>;

/// Version 2 of the list, counted from 0.
constexpr long version_2 = 1;

TimeOwner asn1_of(Time time) {
  TimeOwner made(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(time)));
  expect(made != nullptr, "a CRL cannot hold this date");
  return made;
}

/// OID of our own extension: OIDs below 2.25 are UUIDs and need no registration (ITU-T X.667). The
/// extension is not critical, so that readers that do not know it, including Cyclone, ignore it.
const ASN1_OBJECT* name_extension() {
  static const ASN1_OBJECT* const object =
      OBJ_txt2obj("2.25.171396044293063210178403911229311745793", 1);
  return object;
}

void note_name(X509_REVOKED* entry, const std::string& name) {
  const StringOwner text(ASN1_UTF8STRING_new());
  expect(text && ASN1_STRING_set(text.get(), name.data(), static_cast<int>(name.size())) == 1,
         "cannot copy the issuer's name");
  unsigned char* raw = nullptr;
  const int size = i2d_ASN1_UTF8STRING(text.get(), &raw);
  const BytesOwner bytes(raw);
  const OctetsOwner value(ASN1_OCTET_STRING_new());
  expect(size > 0 && value && ASN1_OCTET_STRING_set(value.get(), raw, size) == 1,
         "cannot copy the issuer's name");
  const ExtensionOwner extension(
      X509_EXTENSION_create_by_OBJ(nullptr, name_extension(), 0, value.get()));
  expect(extension && X509_REVOKED_add_ext(entry, extension.get(), -1) == 1,
         "cannot copy the issuer's name");
}

/// Empty if no name is recorded.
std::string noted_name(const X509_REVOKED* entry) {
  const int at = X509_REVOKED_get_ext_by_OBJ(entry, name_extension(), -1);
  if (at < 0) {
    return {};
  }
  const ASN1_OCTET_STRING* value = X509_EXTENSION_get_data(X509_REVOKED_get_ext(entry, at));
  const unsigned char* bytes = ASN1_STRING_get0_data(value);
  const StringOwner text(d2i_ASN1_UTF8STRING(nullptr, &bytes, ASN1_STRING_length(value)));
  if (!text) {
    last_reason();
    return {};
  }
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes of UTF-8.
  return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(text.get())),
          static_cast<std::size_t>(ASN1_STRING_length(text.get()))};
}

void add(X509_CRL* list, const Revoked& revoked) {
  BIGNUM* parsed = nullptr;
  const int digits = BN_hex2bn(&parsed, revoked.serial.c_str());
  const NumberOwner number(parsed);
  expect(digits > 0 && digits == static_cast<int>(revoked.serial.size()),
         fmt::format("{} is not a serial number", revoked.serial));
  const IntegerOwner serial(BN_to_ASN1_INTEGER(number.get(), nullptr));
  EntryOwner entry(X509_REVOKED_new());
  expect(entry && X509_REVOKED_set_serialNumber(entry.get(), serial.get()) == 1 &&
             X509_REVOKED_set_revocationDate(entry.get(), asn1_of(revoked.at).get()) == 1,
         "cannot revoke a certificate");
  if (!revoked.name.empty()) {
    note_name(entry.get(), revoked.name);
  }
  expect(X509_CRL_add0_revoked(list, entry.get()) == 1, "cannot revoke a certificate");
  // the list owns it now
  static_cast<void>(entry.release());
}

}  // namespace

std::string revocation_list(const std::vector<Revoked>& revoked, const Certificate& authority,
                            const Key& authority_key, Time from, Time until) {
  const ListOwner list(X509_CRL_new());
  expect(list != nullptr, "cannot create a CRL");
  X509_CRL_set_version(list.get(), version_2);
  X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(authority.get()));
  X509_CRL_set1_lastUpdate(list.get(), asn1_of(from).get());
  X509_CRL_set1_nextUpdate(list.get(), asn1_of(until).get());
  for (const Revoked& entry : revoked) {
    add(list.get(), entry);
  }
  X509_CRL_sort(list.get());
  expect(X509_CRL_sign(list.get(), authority_key.get(), EVP_sha256()) > 0, "cannot sign a CRL");
  const BioOwner out = writing();
  expect(PEM_write_bio_X509_CRL(out.get(), list.get()) == 1, "cannot write a CRL");
  return written(*out);
}

tl::expected<RevocationList, std::string> RevocationList::read(std::string_view pem) {
  const BioOwner in = reading(pem);
  Owner list(PEM_read_bio_X509_CRL(
      in.get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr));
  if (!list) {
    return tl::unexpected(fmt::format("is not a CRL in PEM ({})", last_reason()));
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

std::set<std::string> RevocationList::common_names() const {
  std::set<std::string> names;
  const STACK_OF(X509_REVOKED)* entries = X509_CRL_get_REVOKED(list_.get());
  for (int i = 0; i < sk_X509_REVOKED_num(entries); ++i) {
    if (std::string name = noted_name(sk_X509_REVOKED_value(entries, i)); !name.empty()) {
      names.insert(std::move(name));
    }
  }
  return names;
}

Time RevocationList::from() const {
  return time_of(X509_CRL_get0_lastUpdate(list_.get()));
}

}  // namespace millrace::base::openssl
