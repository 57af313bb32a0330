#include "fabric/ends/notice_end.hpp"

#include <exception>
#include <optional>

#include <boost/asio/steady_timer.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "fabric/certificate_end.hpp"
#include "fabric/dds/trust.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

namespace {

/// How often it is seen whether the certificate ends soon.
constexpr std::chrono::hours between_looks{1};

}  // namespace

struct NoticeEnd::Impl : std::enable_shared_from_this<Impl> {
  Impl(const dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       Notice who)
      : participant(own_participant),
        board(std::move(who)),
        timer(executor),
        certificate_timer(executor) {}

  tl::expected<void, std::string> open();
  tl::expected<void, std::string> tell();
  void repeat();
  void schedule();
  void look_at_certificate();

  const dds::Participant& participant;
  NoticeBoard board;
  std::optional<wire::Writer<Notice>> writer;
  boost::asio::steady_timer timer;
  boost::asio::steady_timer certificate_timer;
  bool scheduled = false;
};

tl::expected<void, std::string> NoticeEnd::Impl::open() {
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

tl::expected<void, std::string> NoticeEnd::Impl::tell() {
  schedule();
  if (auto opened = open(); !opened) {
    return opened;
  }
  tl::expected<void, std::string> result;
  const NoticeBoard::Changes changes = board.changes();
  for (const Notice& notice : changes.to_take_back) {
    writer->withdraw(notice);
  }
  for (const Notice& notice : changes.to_tell) {
    if (auto written = writer->write(notice); !written) {
      result = std::move(written);
    }
  }
  return result;
}

void NoticeEnd::Impl::schedule() {
  if (scheduled || board.empty()) {
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

/// What fails here fails again, and is told when something new is said.
void NoticeEnd::Impl::repeat() {
  static_cast<void>(tell());
  for (const auto& [key, notice] : board.told()) {
    static_cast<void>(writer->write(notice));
  }
}

/// What comes of telling it is of no interest: it is tried again with the next one.
void NoticeEnd::Impl::look_at_certificate() {
  const dds::Trust& trust = *participant.options().trust;
  const auto now = std::chrono::system_clock::now();
  if (trust.until - now < certificate_ends_soon) {
    board.raise(
        {.key = {.kind = "certificate"},
         .level = NoticeLevel::warning,
         .text = fmt::format("its certificate ({}) ends on {:%F %R} UTC", trust.name, trust.until),
         .advice = fmt::format("`millrace trust renew PLANT {}` where the plant's "
                               "authorities are, copy the folder anew, and restart it",
                               trust.name)},
        now);
    static_cast<void>(tell());
    return;
  }
  certificate_timer.expires_after(between_looks);
  certificate_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
    const auto self = weak.lock();
    if (!error && self) {
      self->look_at_certificate();
    }
  });
}

NoticeEnd::NoticeEnd(const dds::Participant& participant,
                     const boost::asio::any_io_executor& executor, Notice who)
    : impl_(std::make_shared<Impl>(participant, executor, std::move(who))) {
  if (participant.options().trust) {
    impl_->look_at_certificate();
  }
}

NoticeEnd::~NoticeEnd() {
  impl_->timer.cancel();
  impl_->certificate_timer.cancel();
  if (impl_->writer) {
    for (const auto& [key, notice] : impl_->board.told()) {
      impl_->writer->withdraw(notice);
    }
  }
  impl_->writer.reset();
}

tl::expected<void, std::string> NoticeEnd::raise(const Notice& notice) {
  impl_->board.raise(notice, std::chrono::system_clock::now());
  return impl_->tell();
}

tl::expected<void, std::string> NoticeEnd::clear(const std::string& kind,
                                                 const std::string& subject) {
  impl_->board.clear(kind, subject);
  // Whoever has said nothing yet has nothing to take back.
  return impl_->writer ? impl_->tell() : tl::expected<void, std::string>();
}

}  // namespace millrace::fabric::ends
