#include "tests/simulation/gateway/disk.hpp"

#include <algorithm>

namespace millrace::tests::simulation {

namespace {

tl::unexpected<std::string> no_space() {
  return tl::unexpected(std::string("cannot be written: No space left on device"));
}

}  // namespace

bool Disk::cut_power() {
  if (forced_ >= written_.size()) {
    return false;
  }
  const std::size_t kept = forced_ + random_.below(written_.size() - forced_);
  written_.resize(kept);
  if (kept > forced_ && random_.chance(30)) {
    // A block that the disk had only announced.
    std::fill(
        written_.begin() + static_cast<std::ptrdiff_t>(forced_ + random_.below(kept - forced_)),
        written_.end(), '\0');
  }
  forced_ = written_.size();
  return true;
}

void Disk::wipe() {
  written_.clear();
  forced_ = 0;
}

tl::expected<void, std::string> Disk::append(std::string_view bytes) {
  if (full) {
    written_ += bytes.substr(0, random_.below(bytes.size()));
    return no_space();
  }
  written_ += bytes;
  return {};
}

tl::expected<void, std::string> Disk::replace(std::string_view bytes) {
  if (full) {
    return no_space();
  }
  written_ = bytes;
  forced_ = written_.size();
  ++replaced_;
  return {};
}

void Disk::start_force() {
  process_.after(random_.between(slow_least, slow_most), [this, upto = written_.size(),
                                                          file = replaced_] {
    // Of a file that was replaced meanwhile nothing is left.
    if (file == replaced_) {
      forced_ = std::max(forced_, upto);
    }
    on_forced(full && random_.chance(20) ? "cannot be forced to the disk: Input/output error" : "");
  });
}

void Disk::confirm(std::vector<gateway::journal::Recorded> recorded) {
  for (auto& one : recorded) {
    process_.after(Time{}, std::move(one), 1);
  }
}

void Disk::tell(const std::string& trouble) {
  process_.after(Time{}, [this, trouble] { on_trouble(trouble); });
}

}  // namespace millrace::tests::simulation
