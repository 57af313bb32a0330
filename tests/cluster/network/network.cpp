#include "tests/cluster/network/network.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace millrace::tests::cluster {

// A TAP device: an Ethernet interface of a network namespace whose other end is a descriptor.

class Tap {
 public:
  /// Makes the device `name` in the namespace; it vanishes with this object. Throws
  /// std::system_error.
  Tap(const std::filesystem::path& network_namespace, const std::string& name);
  ~Tap();
  Tap(Tap&& other) noexcept;
  Tap& operator=(Tap&&) = delete;

  /// For poll().
  [[nodiscard]] int descriptor() const { return descriptor_; }
  /// The next frame, or an empty string if there is none. Never blocks.
  [[nodiscard]] std::string read() const;
  /// The frame is lost if the host has no room for it, as on a wire.
  void write(const std::string& frame) const;

 private:
  int descriptor_;
};

namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int open_file(const std::filesystem::path& file, int flags) {
  const int descriptor = ::open(file.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) {
    fail(file.string());
  }
  return descriptor;
}

/// Moves the calling thread to a network namespace for as long as it lives.
class InNamespace {
 public:
  explicit InNamespace(const std::filesystem::path& there)
      : home_(open_file("/proc/thread-self/ns/net", O_RDONLY)) {
    const int descriptor = open_file(there, O_RDONLY);
    const int moved = ::setns(descriptor, CLONE_NEWNET);
    ::close(descriptor);
    if (moved != 0) {
      ::close(home_);
      fail("cannot enter the network namespace " + there.string());
    }
  }
  ~InNamespace() {
    ::setns(home_, CLONE_NEWNET);
    ::close(home_);
  }
  InNamespace(const InNamespace&) = delete;
  InNamespace& operator=(const InNamespace&) = delete;

 private:
  int home_;
};

}  // namespace

Tap::Tap(const std::filesystem::path& network_namespace, const std::string& name) {
  const InNamespace there(network_namespace);
  descriptor_ = open_file("/dev/net/tun", O_RDWR | O_NONBLOCK);
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  if (::ioctl(descriptor_, TUNSETIFF, &request) != 0) {
    ::close(descriptor_);
    fail("cannot make the TAP device " + name);
  }
}

Tap::~Tap() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

Tap::Tap(Tap&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

std::string Tap::read() const {
  std::array<char, 2048> buffer{};  // more than an Ethernet frame
  const ssize_t length = ::read(descriptor_, buffer.data(), buffer.size());
  return length > 0 ? std::string(buffer.data(), static_cast<std::size_t>(length)) : std::string();
}

void Tap::write(const std::string& frame) const {
  [[maybe_unused]] const ssize_t written = ::write(descriptor_, frame.data(), frame.size());
}

struct Network::Impl {
  Impl(std::vector<Port> own_ports, std::uint64_t seed)
      : ports(std::move(own_ports)), middle(ports.size(), seed), stop(::eventfd(0, EFD_CLOEXEC)) {
    for (const Port& port : ports) {
      taps.emplace_back(port.network_namespace, port.device);
    }
    pump = std::thread([this] { run(); });
  }
  ~Impl() {
    ::eventfd_write(stop, 1);
    pump.join();
    ::close(stop);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] std::size_t index(const std::string& host) const {
    const auto port =
        std::ranges::find_if(ports, [&](const Port& each) { return each.host == host; });
    if (port == ports.end()) {
      throw std::invalid_argument("no host is called " + host);
    }
    return static_cast<std::size_t>(port - ports.begin());
  }

  void change_all(const std::function<void(Way&)>& change) {
    const std::lock_guard lock(mutex);
    for (std::size_t from = 0; from < ports.size(); ++from) {
      for (std::size_t to = 0; to < ports.size(); ++to) {
        change(middle.way(from, to));
      }
    }
  }

  void change_both_ways(const std::string& host, const std::function<void(Way&)>& change) {
    const std::size_t here = index(host);
    const std::lock_guard lock(mutex);
    for (std::size_t there = 0; there < ports.size(); ++there) {
      change(middle.way(here, there));
      change(middle.way(there, here));
    }
  }

  void run() {
    std::vector<pollfd> waited;
    for (const Tap& tap : taps) {
      waited.push_back({tap.descriptor(), POLLIN, 0});
    }
    waited.push_back({stop, POLLIN, 0});
    while (waited.back().revents == 0) {
      wait(waited);
      carry();
    }
  }

  /// Waits until a frame arrives or is due.
  void wait(std::vector<pollfd>& waited) {
    std::optional<Switch::Time> next;
    {
      const std::lock_guard lock(mutex);
      next = middle.next();
    }
    timespec limit{};
    if (next) {
      const auto left = std::max(*next - Switch::Time::clock::now(), Switch::Time::duration{0});
      const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
      limit = {seconds.count(), std::chrono::nanoseconds(left - seconds).count()};
    }
    ::ppoll(waited.data(), waited.size(), next ? &limit : nullptr, nullptr);
  }

  void carry() {
    const std::lock_guard lock(mutex);
    const auto now = Switch::Time::clock::now();
    for (std::size_t i = 0; i < taps.size(); ++i) {
      for (std::string frame = taps[i].read(); !frame.empty(); frame = taps[i].read()) {
        middle.take(i, std::move(frame), now);
      }
    }
    for (const Delivery& each : middle.due(now)) {
      taps[each.port].write(each.frame);
    }
  }

  const std::vector<Port> ports;
  std::vector<Tap> taps;
  mutable std::mutex mutex;
  Switch middle;
  const int stop;
  std::thread pump;
};

Network::Network(std::vector<Port> ports, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(std::move(ports), seed)) {}

Network::~Network() = default;

void Network::cut(const std::string& host) {
  impl_->change_both_ways(host, [](Way& way) { way.cut = true; });
}

void Network::stop_multicast(const std::string& host) {
  impl_->change_both_ways(host, [](Way& way) { way.multicast = false; });
}

void Network::cut_one_way(const std::string& from, const std::string& to) {
  const std::size_t a = impl_->index(from);
  const std::size_t b = impl_->index(to);
  const std::lock_guard lock(impl_->mutex);
  impl_->middle.way(a, b).cut = true;
}

void Network::heal() {
  impl_->change_all([](Way& way) { way.cut = false; });
}

void Network::loss(double share) {
  impl_->change_all([=](Way& way) { way.loss = share; });
}

void Network::delay(std::chrono::microseconds delay, std::chrono::microseconds jitter) {
  impl_->change_all([=](Way& way) {
    way.delay = delay;
    way.jitter = jitter;
  });
}

Switch::Counters Network::counters() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->middle.counters();
}

}  // namespace millrace::tests::cluster
