// The state of a millrace_participant: this process on its fabric, shared by its handles.
#pragma once

#include <atomic>
#include <exception>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <type_traits>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <sys/types.h>
#include <unistd.h>

#include "base/program/log.hpp"
#include "services/c/errors.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/shared_participant.hpp"

namespace millrace::services::c {

class Requests;

/// Throws Error in a process that was forked from that of `owner`.
inline void check_process(pid_t owner) {
  if (::getpid() != owner) {
    throw Error(MILLRACE_FORKED,
                fmt::format("the handle belongs to process {}, which has forked this one; call "
                            "millrace_join in this process",
                            owner));
  }
}

class Participant {
 public:
  explicit Participant(const millrace_participant_options& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] const std::shared_ptr<sdk::SharedParticipant>& shared() const { return shared_; }
  [[nodiscard]] const base::program::Log& log() const { return log_; }
  [[nodiscard]] std::uint32_t domain() const { return join_.domain; }
  /// For further participants of this process.
  [[nodiscard]] const fabric::dds::ParticipantOptions& join() const { return join_; }
  [[nodiscard]] pid_t process() const { return process_; }
  [[nodiscard]] bool expired() const { return *expired_; }
  /// Throws Error unless the process discovers the others.
  void check_discovers(const char* what) const;

  /// Drains the instance when the certificate of the process has expired.
  void add(const fabric::InstanceId& instance);
  void remove(const fabric::InstanceId& instance);
  /// Made at its first use.
  [[nodiscard]] Requests& requests();

  /// Runs `work` on the loop of the process and waits for its result or exception.
  template <typename Work>
  auto on_loop(const Work& work) {
    std::promise<std::invoke_result_t<Work>> done;
    boost::asio::dispatch(shared_->loop(), [&work, &done] {
      try {
        if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
          work();
          done.set_value();
        } else {
          done.set_value(work());
        }
      } catch (...) {
        done.set_exception(std::current_exception());
      }
    });
    return done.get_future().get();
  }

 private:
  /// For the thread that checks the certificate. It ends with the member.
  struct Instances {
    std::mutex lock;
    sdk::SharedParticipant* shared = nullptr;
    std::set<fabric::InstanceId> all{};
  };

  const pid_t process_ = ::getpid();
  const bool discovers_;
  const std::shared_ptr<std::atomic<bool>> expired_ = std::make_shared<std::atomic<bool>>(false);
  const std::shared_ptr<Instances> instances_ = std::make_shared<Instances>();
  base::program::Log log_;
  fabric::dds::ParticipantOptions join_;
  std::shared_ptr<sdk::SharedParticipant> shared_;
  std::mutex lock_;
  std::unique_ptr<Requests> requests_;
};

/// Throws Error for NULL and in a forked process.
std::shared_ptr<Participant> state_of(const millrace_participant* participant);

}  // namespace millrace::services::c

struct millrace_participant {
  std::shared_ptr<millrace::services::c::Participant> state;
};
