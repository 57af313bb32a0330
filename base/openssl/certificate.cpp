#include "base/openssl/certificate.hpp"

#include <array>
#include <cctype>

#include <fmt/format.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

namespace millrace::base::openssl {

namespace {

using NumberOwner = std::unique_ptr<BIGNUM, Free<BN_free>>;
using ExtensionOwner = std::unique_ptr<X509_EXTENSION, Free<X509_EXTENSION_free>>;

/// X.509 counts versions from 0.
constexpr long version_3 = 2;
/// A positive number of this size fits every reader (RFC 5280 allows 20 bytes).
constexpr int serial_bits = 127;

void set_name(X509_NAME* name, const Subject& subject) {
  const auto add = [name](const char* field, const std::string& text) {
    expect(X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8,
                                      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
                                      reinterpret_cast<const unsigned char*>(text.data()),
                                      static_cast<int>(text.size()), -1, 0) == 1,
           fmt::format("a certificate cannot say {}={}", field, text));
  };
  add("O", subject.organisation);
  add("CN", subject.common_name);
  if (!subject.number.empty()) {
    add("serialNumber", subject.number);
  }
}

NumberOwner serial_number(const std::string& given) {
  if (given.empty()) {
    NumberOwner drawn(BN_new());
    expect(drawn && BN_rand(drawn.get(), serial_bits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1,
           "cannot draw a serial number");
    return drawn;
  }
  BIGNUM* parsed = nullptr;
  const int digits = BN_hex2bn(&parsed, given.c_str());
  NumberOwner number(parsed);
  expect(digits > 0 && digits == static_cast<int>(given.size()),
         fmt::format("{} is not a serial number", given));
  return number;
}

void set_serial(X509* certificate, const std::string& given) {
  const NumberOwner number = serial_number(given);
  expect(BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr,
         "cannot set a serial number");
}

void set_time(ASN1_TIME* field, Time time) {
  expect(ASN1_TIME_set(field, std::chrono::system_clock::to_time_t(time)) != nullptr,
         "a certificate cannot hold this date");
}

void extend(X509* certificate, X509* authority, int what, const char* value) {
  X509V3_CTX context{};
  X509V3_set_ctx(&context, authority, certificate, nullptr, nullptr, 0);
  const ExtensionOwner extension(X509V3_EXT_conf_nid(nullptr, &context, what, value));
  expect(extension && X509_add_ext(certificate, extension.get(), -1) == 1,
         fmt::format("cannot add {} to a certificate", value));
}

/// Sets all fields except the signature.
void fill(X509* certificate, const Key& key, const Subject& subject) {
  expect(certificate != nullptr, "cannot make a certificate");
  X509_set_version(certificate, version_3);
  set_serial(certificate, subject.serial);
  set_name(X509_get_subject_name(certificate), subject);
  set_time(X509_getm_notBefore(certificate), subject.from);
  set_time(X509_getm_notAfter(certificate), subject.until);
  expect(X509_set_pubkey(certificate, key.get()) == 1, "cannot use this key");
}

/// One part of a name, in UTF-8; empty if it is missing.
std::string named(const X509_NAME* name, int what) {
  const int at = X509_NAME_get_index_by_NID(name, what, -1);
  if (at < 0) {
    return {};
  }
  const ASN1_STRING* text = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at));
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, text);
  if (size < 0) {
    return {};
  }
  std::string result(utf8, utf8 + size);
  OPENSSL_free(utf8);
  return result;
}

}  // namespace

tl::expected<Certificate, std::string> Certificate::read(std::string_view pem) {
  const BioOwner in = reading(pem);
  // No certificate is encrypted; without a callback OpenSSL would prompt on the terminal.
  Owner certificate(PEM_read_bio_X509(
      in.get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr));
  if (!certificate) {
    return tl::unexpected(fmt::format("is not a certificate in PEM ({})", last_reason()));
  }
  return Certificate(std::move(certificate));
}

std::string Certificate::pem() const {
  const BioOwner out = writing();
  expect(PEM_write_bio_X509(out.get(), certificate_.get()) == 1, "cannot write a certificate");
  return written(*out);
}

std::string Certificate::common_name() const {
  return common_name_of(certificate_.get());
}

std::string Certificate::fingerprint() const {
  return fingerprint_of(certificate_.get());
}

std::string common_name_of(const X509* certificate) {
  return named(X509_get_subject_name(certificate), NID_commonName);
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  expect(X509_digest(certificate, EVP_sha256(), digest.data(), &size) == 1,
         "cannot digest a certificate");
  return fmt::format("{:02X}", fmt::join(digest.begin(), digest.begin() + size, ":"));
}

std::optional<std::string> parse_fingerprint(std::string_view text) {
  constexpr std::size_t digits = std::size_t{2} * 32;
  std::string found;
  std::size_t count = 0;
  for (const char c : text) {
    if (c == ':' || c == ' ') {
      continue;
    }
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0 || count == digits) {
      return std::nullopt;
    }
    if (count > 0 && count % 2 == 0) {
      found += ':';
    }
    found += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    ++count;
  }
  return count == digits ? std::optional(found) : std::nullopt;
}

std::string Certificate::organisation() const {
  return named(X509_get_subject_name(certificate_.get()), NID_organizationName);
}

std::string Certificate::subject() const {
  const BioOwner out = writing();
  X509_NAME_print_ex(out.get(), X509_get_subject_name(certificate_.get()), 0, XN_FLAG_RFC2253);
  return written(*out);
}

std::string Certificate::serial() const {
  const NumberOwner number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate_.get()), nullptr));
  const std::unique_ptr<char, Free<[](char* text) { OPENSSL_free(text); }>> text(
      BN_bn2hex(number.get()));
  return text ? text.get() : "";
}

Time Certificate::from() const {
  return time_of(X509_get0_notBefore(certificate_.get()));
}

Time Certificate::until() const {
  return time_of(X509_get0_notAfter(certificate_.get()));
}

bool Certificate::is_issued_by(const Certificate& authority) const {
  const bool issued = X509_check_issued(authority.get(), get()) == X509_V_OK &&
                      X509_verify(get(), X509_get0_pubkey(authority.get())) == 1;
  last_reason();
  return issued;
}

bool Certificate::belongs_to(const Key& key) const {
  const bool belongs = X509_check_private_key(get(), key.get()) == 1;
  last_reason();
  return belongs;
}

std::string encoded_name(const Subject& subject) {
  const std::unique_ptr<X509_NAME, Free<X509_NAME_free>> name(X509_NAME_new());
  expect(name != nullptr, "cannot create an X.509 name");
  set_name(name.get(), subject);
  unsigned char* bytes = nullptr;
  const int size = i2d_X509_NAME(name.get(), &bytes);
  expect(size > 0, "cannot encode an X.509 name");
  std::string encoded(bytes, bytes + size);
  OPENSSL_free(bytes);
  return encoded;
}

Certificate self_signed(const Key& key, const Subject& subject) {
  Certificate::Owner made(X509_new());
  fill(made.get(), key, subject);
  X509_set_issuer_name(made.get(), X509_get_subject_name(made.get()));
  extend(made.get(), made.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  extend(made.get(), made.get(), NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature");
  extend(made.get(), made.get(), NID_subject_key_identifier, "hash");
  expect(X509_sign(made.get(), key.get(), EVP_sha256()) > 0, "cannot sign a certificate");
  return Certificate(std::move(made));
}

Certificate issue(const Key& holder, const Subject& subject, const Certificate& authority,
                  const Key& authority_key) {
  Certificate::Owner made(X509_new());
  fill(made.get(), holder, subject);
  X509_set_issuer_name(made.get(), X509_get_subject_name(authority.get()));
  extend(made.get(), authority.get(), NID_basic_constraints, "critical,CA:FALSE");
  extend(made.get(), authority.get(), NID_key_usage, "critical,digitalSignature,keyAgreement");
  extend(made.get(), authority.get(), NID_subject_key_identifier, "hash");
  extend(made.get(), authority.get(), NID_authority_key_identifier, "keyid");
  expect(X509_sign(made.get(), authority_key.get(), EVP_sha256()) > 0, "cannot sign a certificate");
  return Certificate(std::move(made));
}

}  // namespace millrace::base::openssl
