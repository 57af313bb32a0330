#include "services/c/errors.hpp"

#include "base/program/command_line.hpp"
#include "base/program/version.hpp"

namespace millrace::services::c {

namespace {

std::string& last_error() {
  thread_local std::string text;
  return text;
}

}  // namespace

void remember_error(std::string_view text) noexcept {
  try {
    last_error() = text;
  } catch (...) {
    last_error().clear();
  }
}

millrace_code code_of_exception() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    remember_error(error.what());
    return error.code();
  } catch (const std::invalid_argument& error) {
    remember_error(error.what());
    return MILLRACE_INVALID;
  } catch (const base::program::UsageError& error) {
    remember_error(error.what());
    return MILLRACE_INVALID;
  } catch (const std::exception& error) {
    remember_error(error.what());
  } catch (...) {
    remember_error("an exception of an unknown type");
  }
  return MILLRACE_FAILED;
}

}  // namespace millrace::services::c

const char* millrace_error(void) {
  return millrace::services::c::last_error().c_str();
}

const char* millrace_code_text(millrace_code code) {
  switch (code) {
    case MILLRACE_OK:
      return "done";
    case MILLRACE_INVALID:
      return "an argument, an option, a file or a variable of the environment is wrong";
    case MILLRACE_NOT_CONNECTED:
      return "the fabric cannot be joined";
    case MILLRACE_NOTHING:
      return "nothing came within the time";
    case MILLRACE_CLOSED:
      return "the service has left the fabric, or the observer is closed";
    case MILLRACE_ENDED:
      return "the call was answered or declined before";
    case MILLRACE_UNSERVED:
      return "no instance serves this UUID for this channel";
    case MILLRACE_NO_RESPONSE:
      return "no final response came within the time-out";
    case MILLRACE_INTERIM:
      return "an interim response";
    case MILLRACE_FORKED:
      return "the handle belongs to the process that has forked this one";
    case MILLRACE_FAILED:
      return "the process has no resources left, or DDS reports an error";
    default:
      return "unknown code";
  }
}

const char* millrace_version(void) {
  return millrace::base::program::version();
}
