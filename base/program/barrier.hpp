// Barriers for exceptions where no caller can catch them: in callbacks of C libraries, in threads
// of libraries, in detached coroutines.
//
//   dds_lset_data_available_arg(
//       listener,
//       [](dds_entity_t, void* self) noexcept {
//         contain("waking for data", [&] { static_cast<Reader*>(self)->wake(); });
//       }, …);
//   asio::co_spawn(executor, accept(self), rethrow_from_loop);      // not asio::detached
#pragma once

#include <exception>
#include <functional>
#include <string>
#include <string_view>

namespace millrace::base::program {

/// Reports that `error` has ended the work at `where`: as a line in the log (make_log), or on
/// standard error if there is no log. Only the 1st, 2nd, 4th, 8th … error of each place is
/// reported.
void report_contained(std::string_view where, const std::exception_ptr& error) noexcept;

/// Sets the output of report_contained(); `report` returns false if the log is gone. From any
/// thread. Called without a lock held, possibly by several threads.
void report_contained_to(std::function<bool(const std::string& line)> report);

/// Runs `work`, and reports an exception in place of propagating it: into C code that cannot be
/// unwound, or out of a thread that others need.
template <typename Work>
void contain(std::string_view where, const Work& work) noexcept {
  try {
    work();
  } catch (...) {
    report_contained(where, std::current_exception());
  }
}

/// For co_spawn in place of asio::detached, which drops exceptions: an exception of the coroutine
/// leaves the run() of its event loop and ends the process, with a message.
inline void rethrow_from_loop(const std::exception_ptr& error) {
  if (error) {
    std::rethrow_exception(error);
  }
}

}  // namespace millrace::base::program
