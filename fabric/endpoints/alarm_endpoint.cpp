#include "fabric/endpoints/alarm_endpoint.hpp"

#include <exception>
#include <optional>

#include <boost/asio/steady_timer.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

namespace {

/// How often the expiry of the certificate is checked.
constexpr std::chrono::hours between_looks{1};

}  // namespace

struct AlarmEndpoint::Impl : std::enable_shared_from_this<Impl> {
  Impl(const dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       Alarm who)
      : participant(own_participant),
        table(std::move(who)),
        timer(executor),
        certificate_timer(executor) {}

  tl::expected<void, std::string> open();
  tl::expected<void, std::string> tell();
  void repeat();
  void schedule();
  void check_certificate();

  const dds::Participant& participant;
  AlarmTable table;
  std::optional<wire::Writer<Alarm>> writer;
  boost::asio::steady_timer timer;
  boost::asio::steady_timer certificate_timer;
  bool scheduled = false;
  bool left = false;
};

tl::expected<void, std::string> AlarmEndpoint::Impl::open() {
  if (!writer) {
    try {
      writer.emplace(participant, participant.options().fabric,
                     wire::EndpointOptions{.lease = lease});
    } catch (const std::exception& error) {
      return tl::unexpected(std::string(error.what()));
    }
  }
  return {};
}

tl::expected<void, std::string> AlarmEndpoint::Impl::tell() {
  schedule();
  if (auto opened = open(); !opened) {
    return opened;
  }
  tl::expected<void, std::string> result;
  const AlarmTable::Changes changes = table.changes();
  for (const Alarm& alarm : changes.to_dispose) {
    writer->withdraw(alarm);
  }
  for (const Alarm& alarm : changes.to_publish) {
    if (auto written = writer->write(alarm); !written) {
      result = std::move(written);
    }
  }
  return result;
}

void AlarmEndpoint::Impl::schedule() {
  if (scheduled || table.empty()) {
    return;
  }
  scheduled = true;
  timer.expires_after(lease / repeats_per_lease);
  timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!error && self) {
      self->scheduled = false;
      self->repeat();
    }
  });
}

/// A failure here repeats and is reported with the next change.
void AlarmEndpoint::Impl::repeat() {
  static_cast<void>(tell());
  for (const auto& [key, alarm] : table.published()) {
    static_cast<void>(writer->write(alarm));
  }
}

/// The result is ignored: the next alarm publishes again.
void AlarmEndpoint::Impl::check_certificate() {
  const dds::Trust& trust = *participant.options().trust;
  const auto now = std::chrono::system_clock::now();
  if (trust.until - now < certificate_expires_soon) {
    table.raise({.key = {.kind = "certificate"},
                 .level = AlarmLevel::warning,
                 .text = base::messages::certificate_expires(trust.name,
                                                             fmt::format("{:%F %R}", trust.until)),
                 .advice = base::messages::renew_certificate(trust.name)},
                now);
    static_cast<void>(tell());
    return;
  }
  certificate_timer.expires_after(between_looks);
  certificate_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!error && self) {
      self->check_certificate();
    }
  });
}

AlarmEndpoint::AlarmEndpoint(const dds::Participant& participant,
                             const boost::asio::any_io_executor& executor, Alarm who)
    : impl_(std::make_shared<Impl>(participant, executor, std::move(who))) {
  if (participant.options().trust) {
    impl_->check_certificate();
  }
}

AlarmEndpoint::~AlarmEndpoint() {
  impl_->timer.cancel();
  impl_->certificate_timer.cancel();
  if (impl_->writer && !impl_->left) {
    for (const auto& [key, alarm] : impl_->table.published()) {
      impl_->writer->withdraw(alarm);
    }
  }
  impl_->writer.reset();
}

tl::expected<void, std::string> AlarmEndpoint::raise(const Alarm& alarm) {
  impl_->table.raise(alarm, std::chrono::system_clock::now());
  return impl_->tell();
}

tl::expected<void, std::string> AlarmEndpoint::clear(const std::string& kind,
                                                     const std::string& subject) {
  impl_->table.clear(kind, subject);
  // Without an alarm so far there is nothing to retract.
  return impl_->writer ? impl_->tell() : tl::expected<void, std::string>();
}

void AlarmEndpoint::leave_alarms() {
  impl_->left = true;
}

}  // namespace millrace::fabric::endpoints
