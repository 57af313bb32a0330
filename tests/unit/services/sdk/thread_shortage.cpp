#include "tests/unit/services/sdk/thread_shortage.hpp"

#include <atomic>
#include <cerrno>
#include <limits>

#include <dlfcn.h>
#include <pthread.h>

namespace {

constexpr int plenty = std::numeric_limits<int>::max();
std::atomic<int> left = plenty;

using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);

}  // namespace

/// Replaces that of the C library, for every library of this process.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) noexcept {
  static const auto real = reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"));
  if (left != plenty && left.fetch_sub(1) <= 0) {
    return EAGAIN;
  }
  return real(thread, attributes, start, argument);
}

namespace millrace::tests {

ThreadShortage::ThreadShortage(int wanted) {
  left = wanted;
}

ThreadShortage::~ThreadShortage() {
  left = plenty;
}

}  // namespace millrace::tests
