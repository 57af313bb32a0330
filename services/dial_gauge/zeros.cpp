#include "services/dial_gauge/zeros.hpp"

#include <google/protobuf/text_format.h>

#include "base/configuration/config_file.hpp"
#include "base/posix/durable_file.hpp"
#include "idl/dial_gauge.pb.h"

namespace millrace::services::dial_gauge {

tl::expected<Zeros, std::string> read_zeros(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return Zeros{};
  }
  const auto from = base::configuration::read_config<config::DialGaugeZeros>(file);
  if (!from) {
    return tl::unexpected(from.error());
  }
  Zeros zeros;
  for (const auto& zero : from->zero()) {
    zeros[zero.gauge()] = zero.nanometres();
  }
  return zeros;
}

tl::expected<void, std::string> keep_zeros(const std::filesystem::path& file, const Zeros& zeros) {
  config::DialGaugeZeros to;
  for (const auto& [gauge, nanometres] : zeros) {
    auto* const zero = to.add_zero();
    zero->set_gauge(gauge);
    zero->set_nanometres(nanometres);
  }
  std::string text;
  google::protobuf::TextFormat::PrintToString(to, &text);
  return base::posix::write_durably(file, "# The zero points set by ZERO.\n" + text);
}

}  // namespace millrace::services::dial_gauge
