#include "base/program/barrier.hpp"

#include <bit>
#include <cstdint>
#include <cstdio>
#include <map>
#include <mutex>

namespace millrace::base::program {

namespace {

struct Reports {
  std::mutex lock;
  std::function<bool(const std::string&)> report;
  std::map<std::string, std::uint64_t, std::less<>> seen;
};

/// Never destroyed: threads of libraries may outlive static objects.
Reports& reports() {
  static auto* const all = new Reports;
  return *all;
}

std::string what(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& known) {
    return known.what();
  } catch (...) {
    return "an exception that is not a std::exception";
  }
}

void write(std::string_view where, const std::exception_ptr& error) {
  std::uint64_t times = 0;
  std::function<bool(const std::string&)> report;
  {
    const std::lock_guard guard(reports().lock);
    times = ++reports().seen.try_emplace(std::string(where), 0).first->second;
    report = reports().report;
  }
  if (!std::has_single_bit(times)) {
    return;
  }
  const std::string line = std::string(where) + " failed (" + std::to_string(times) +
                           " so far), the program goes on without it: " + what(error) +
                           ". This should not happen; please report it";
  if (!report || !report(line)) {
    std::fputs((line + "\n").c_str(), stderr);
  }
}

}  // namespace

void report_contained_to(std::function<bool(const std::string& line)> report) {
  const std::lock_guard guard(reports().lock);
  reports().report = std::move(report);
}

void report_contained(std::string_view where, const std::exception_ptr& error) noexcept {
  try {
    write(where, error);
  } catch (...) {
    // There is no memory even for the message.
    std::fputs("an exception was stopped where none may go; its message is lost\n", stderr);
  }
}

}  // namespace millrace::base::program
