#include "cnc/simulator/route_file.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/openssl/certificate.hpp"
#include "base/posix/durable_file.hpp"

namespace millrace::cnc::simulator {

namespace {

ads::Route route_of(const std::string& line, const std::filesystem::path& file) {
  std::istringstream words(line);
  std::string net_id;
  std::string fingerprint;
  words >> net_id >> fingerprint;
  const auto id = ads::NetId::parse(net_id);
  const auto parsed = base::openssl::parse_fingerprint(fingerprint);
  if (!id || (!fingerprint.empty() && !parsed)) {
    throw std::runtime_error(fmt::format(
        "{}: \"{}\"; expected a NetId and a fingerprint, as in 192.168.10.20.1.1 AB:CD:…",
        file.string(), line));
  }
  return {*id, parsed.value_or("")};
}

std::string text_of(const ads::Routes& routes) {
  std::string text;
  for (const ads::Route& route : routes.all()) {
    text += fmt::format("{} {}\n", route.net_id.to_string(), route.fingerprint);
  }
  return text;
}

}  // namespace

std::shared_ptr<ads::Routes> read_routes(const std::filesystem::path& file,
                                         const base::program::Log& log) {
  auto routes = std::make_shared<ads::Routes>();
  std::ifstream in(file);
  for (std::string line; !file.empty() && std::getline(in, line);) {
    routes->add(route_of(line, file));
  }
  if (in.bad() || (!in.is_open() && std::filesystem::exists(file))) {
    throw std::runtime_error(fmt::format("{}: the file of routes cannot be read", file.string()));
  }
  routes->on_added([file, log, known = std::weak_ptr(routes)](const ads::Route& route) {
    log->info("route added to NetId {}{}", route.net_id.to_string(),
              route.fingerprint.empty() ? "" : ", fingerprint " + route.fingerprint);
    const auto all = known.lock();
    const auto written = file.empty() || !all ? tl::expected<void, std::string>()
                                              : base::posix::write_durably(file, text_of(*all));
    if (!written) {
      log->error("this route is not kept after a restart: {}", written.error());
    }
  });
  return routes;
}

}  // namespace millrace::cnc::simulator
