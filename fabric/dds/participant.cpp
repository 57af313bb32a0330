#include "fabric/dds/participant.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stdexcept>

#include <fmt/format.h>
#include <unistd.h>

#include "base/program/barrier.hpp"
#include "base/program/version.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/configuration.hpp"
#include "fabric/dds/entity.hpp"
#include "fabric/participant_identity.hpp"

namespace millrace::fabric::dds {

using namespace std::chrono_literals;

namespace {

/// Cyclone's domains and its log sink belong to the whole process: hold this lock to create or
/// delete a domain.
std::mutex& process_lock() {
  static std::mutex lock;
  return lock;
}

/// Collects Cyclone's log while it exists: the reason why a domain cannot be created is only in the
/// log.
class LogCapture {
 public:
  LogCapture() { dds_set_log_sink(&LogCapture::write, this); }
  ~LogCapture() { take_cyclone_log(); }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  [[nodiscard]] std::string text() const {
    const std::lock_guard guard(lock_);
    return text_;
  }

 private:
  static void write(void* self, const dds_log_data_t* data) noexcept {
    base::program::contain("keeping the log of Cyclone DDS", [&] {
      auto& capture = *static_cast<LogCapture*>(self);
      const std::lock_guard guard(capture.lock_);
      capture.text_.append(data->message, data->size);
      if (!capture.text_.ends_with('\n')) {
        capture.text_ += '\n';
      }
    });
  }

  mutable std::mutex lock_;
  std::string text_;
};

void check_fabric_name(const std::string& name) {
  if (!is_fabric_name(name)) {
    throw std::invalid_argument(fmt::format(
        "'{}' is not a fabric name: expected some text without    ,    ,     and    ", name));
  }
}

[[noreturn]] void fail(std::uint32_t domain, dds_return_t reason, const LogCapture& log,
                       std::string_view uri = {}) {
  throw std::runtime_error(why_not_joined(domain, dds_strretcode(reason), log.text(), uri));
}

/// Once per process.
void report_ignored(std::string_view uri) {
  static const bool reported = [&] {
    fmt::print(stderr,
               "{}: CYCLONEDDS_URI is ignored ({}): the fabric's profile (--fabric-config) "
               "configures the network. Without a profile the variable applies\n",
               program_invocation_short_name, base::text::safe(uri));
    return true;
  }();
  (void)reported;
}

/// Joins what an earlier participant of this process created, or creates the domain.
void ensure_domain(const ParticipantOptions& options, const LogCapture& log) {
  const char* set = std::getenv("CYCLONEDDS_URI");
  const std::string_view uri = set != nullptr ? set : "";
  if (!uri.empty() && !uses_uri(options)) {
    report_ignored(uri);
  }
  const std::string configuration = cyclone_configuration(options, uri);
  dds_entity_t domain = dds_create_domain(options.domain, configuration.c_str());
  const bool is_usual = cyclone_configuration(options, uri, Ports::any) != configuration;
  // A service that others do not find is worth nothing; a tool that finds them is.
  if (domain < 0 && lacks_place(log.text()) &&
      (is_usual || options.finding == Finding::discovers)) {
    domain = dds_create_domain(options.domain, configuration_without_place(options, uri).c_str());
    if (domain >= 0 && !is_usual) {
      fmt::print(stderr,
                 "{}: other processes have all places of this host, so this one uses a port that "
                 "packet filters may close: raise processes_per_host in the fabric's profile, on "
                 "all hosts (in CYCLONEDDS_URI it is MaxAutoParticipantIndex), or end one\n",
                 program_invocation_short_name);
    }
  }
  if (domain < 0 && domain != DDS_RETCODE_PRECONDITION_NOT_MET) {
    fail(options.domain, domain, log, uses_uri(options) ? uri : std::string_view());
  }
}

ProcessVersion own_version() {
  return {.version = base::program::version(),
          .lowest_wire = lowest_wire_version,
          .highest_wire = highest_wire_version};
}

std::chrono::milliseconds participant_lease_of(const ParticipantOptions& options) {
  const bool announces = options.finding == Finding::announces;
  const std::chrono::milliseconds plain = announces ? 10s : 100s;
  const std::chrono::milliseconds trusted = announces ? trusted_service_lease : trusted_tool_lease;
  return std::max(options.lease,
                  options.participant_lease.value_or(options.trust ? trusted : plain));
}

Qos participant_qos(const ParticipantOptions& options) {
  Qos qos(dds_create_qos());
  // A Cyclone extension: on a participant, liveliness sets the lease it announces to others.
  dds_qset_liveliness(qos.get(), DDS_LIVELINESS_AUTOMATIC,
                      DDS_MSECS(participant_lease_of(options).count()));
  if (options.trust) {
    // Cyclone announces the true values to every participant. These replace them; the identity's
    // user_data has the true ones.
    for (const char* const property : {"__ProcessName", "__Pid", "__Hostname"}) {
      dds_qset_prop(qos.get(), property, "");
    }
  } else {
    const std::string version = format_process_version(own_version());
    dds_qset_userdata(qos.get(), version.data(), version.size());
    if (!options.name.empty()) {
      dds_qset_entity_name(qos.get(), options.name.c_str());
    }
  }
  return qos;
}

ProcessInfo process_info_of(const ParticipantOptions& options) {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return {.program = options.name.empty() ? program_invocation_short_name : options.name,
          .host = host.data(),
          .pid = static_cast<std::uint32_t>(::getpid()),
          .version = own_version()};
}

}  // namespace

bool is_fabric_name(std::string_view name) {
  return !name.empty() && name.find_first_of("*?/,") == std::string_view::npos;
}

Participant::Participant(ParticipantOptions options) : options_(std::move(options)) {
  check_fabric_name(options_.fabric);
  const std::lock_guard guard(process_lock());
  const LogCapture log;
  ensure_domain(options_, log);
  handle_ = dds_create_participant(options_.domain, participant_qos(options_).get(), nullptr);
  if (handle_ < 0) {
    fail(options_.domain, handle_, log);
  }
  if (options_.trust) {
    try {
      // Before all other endpoints of this process, so that it is known first.
      authenticator_ =
          std::make_unique<Authenticator>(handle_, options_.fabric, process_info_of(options_),
                                          options_.trust, participant_lease_of(options_));
    } catch (...) {
      leave();
      throw;
    }
  }
}

Participant::~Participant() {
  const std::lock_guard guard(process_lock());
  authenticator_.reset();
  leave();
}

void Participant::leave() {
  const dds_entity_t domain = dds_get_parent(handle_);
  dds_delete(handle_);
  if (dds_lookup_participant(options_.domain, nullptr, 0) == 0) {
    dds_delete(domain);
  }
}

}  // namespace millrace::fabric::dds
