// What a service has to say of its own condition besides answering calls, for whoever looks at the
// fabric: `millrace services`, `health --all`, `doctor`, the page, Prometheus.
//
//   ServiceProgram program({.uuid = "…", .name = "archiver"});
//   program.notices().raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full",
//                            .advice = "make room on the disk"});
//   program.notices().clear("archive", "");
//
// A trouble that an answer tells the program that called is none of these, unless it stays when the
// call is over.
#pragma once

#include <memory>
#include <string>

#include "fabric/notice_sink.hpp"

namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

class Member;

/// Functions may be called from any thread, return at once, and remember what they are told while
/// the service is not on its fabric yet.
class Notices final : public fabric::NoticeSink {
 public:
  Notices();
  ~Notices() override;
  Notices(const Notices&) = delete;
  Notices& operator=(const Notices&) = delete;

  void raise(const fabric::Notice& notice) override;
  void clear(const std::string& kind, const std::string& subject) override;

  /// Tells all of it, as the instance `who`, until leave().
  void join(const std::shared_ptr<Member>& member, const fabric::InstanceIdentity& who,
            std::shared_ptr<spdlog::logger> log);
  /// Takes back what was told, and tells nothing any more.
  void leave();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace millrace::services::sdk
