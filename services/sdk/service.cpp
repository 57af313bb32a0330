#include "services/sdk/service.hpp"

#include <thread>

#include "services/sdk/instance.hpp"
#include "services/sdk/runner.hpp"

namespace millrace::services::sdk {

struct Service::Impl {
  Impl(const ServiceOptions& options, AsyncHandler own_handler, const Log& log)
      : handler(guarded(std::move(own_handler))),
        instance(options, log, options.run_inline ? handler : nullptr) {}
  /// Ends the threads, also if one of them could not be started: no more calls come.
  ~Impl() { instance.leave(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void start(std::uint32_t threads) {
    for (std::uint32_t i = 0; i < threads; ++i) {
      workers.emplace_back([this] {
        while (const auto call = instance.next()) {
          handler(call);
        }
      });
    }
  }

  const AsyncHandler handler;
  Instance instance;
  std::vector<std::jthread> workers;
};

Service::Service(const ServiceOptions& options, Handler handler, const Log& log)
    : Service(options, as_async(std::move(handler)), log) {}

Service::Service(const ServiceOptions& options, AsyncHandler handler, const Log& log)
    : impl_(std::make_unique<Impl>(options, std::move(handler), log)) {
  impl_->start(options.concurrency);
}

Service::~Service() {
  stop();
  wait();
}

void Service::stop() {
  impl_->instance.drain();
}

void Service::wait() {
  impl_->workers.clear();
  impl_->instance.leave();
}

bool Service::drained() const {
  return impl_->instance.drained();
}

const fabric::InstanceIdentity& Service::identity() const {
  return impl_->instance.identity();
}

}  // namespace millrace::services::sdk
