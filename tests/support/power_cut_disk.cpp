#include "tests/support/power_cut_disk.hpp"

#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace millrace::tests {

namespace fs = std::filesystem;

namespace {

/// The C library's own function.
template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

std::mutex lock;
PowerCutDisk::Impl* watching = nullptr;
/// The folder that a power cut was last restored to.
fs::path restored;
/// What the disk itself does is not recorded as a change.
/// Aligned: with less, mold 1.10 begins the program's RELRO on an unmapped page if this variable
/// is the only thread-local one and falls on the last bytes of a page. Such a program cannot start.
alignas(std::max_align_t) thread_local bool looking = false;

fs::path path_of(int fd) {
  std::error_code none;
  return fs::read_symlink("/proc/self/fd/" + std::to_string(fd), none);
}

std::string content(const fs::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

}  // namespace

void PowerCut::restore(const fs::path& folder) const {
  fs::remove_all(folder);
  fs::create_directories(folder);
  {
    const std::lock_guard guard(lock);
    tests::restored = fs::canonical(folder);
  }
  for (const auto& [name, bytes] : files) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }
}

struct PowerCutDisk::Impl {
  /// Identifies a file whatever its name; the file system may reuse its own number.
  using Id = unsigned;
  using Names = std::map<std::string, Id>;

  explicit Impl(const fs::path& watched) : folder(fs::canonical(watched)) {
    forced_names = names();
    for (const auto& [name, id] : forced_names) {
      forced_bytes[id] = content(folder / name);
    }
  }

  [[nodiscard]] bool has(const fs::path& file) const { return file.parent_path() == folder; }

  Names names() {
    Names found;
    for (const auto& entry : fs::directory_iterator(folder)) {
      struct stat status {};
      if (::stat(entry.path().c_str(), &status) == 0 && S_ISREG(status.st_mode)) {
        found[entry.path().filename()] = ids.try_emplace(status.st_ino, ++last_id).first->second;
      }
    }
    return found;
  }

  /// Called before `what` happens.
  void note(const std::string& what) {
    const Names now = names();
    std::map<Id, std::string> bytes_now = forced_bytes;
    for (const auto& [name, id] : now) {
      bytes_now[id] = content(folder / name);
    }
    add(what, "all that was written", now, bytes_now);
    add(what, "what was only written to names", now, forced_bytes);
    add(what, "what was only written to files", forced_names, bytes_now);
    add(what, "nothing that was not forced", forced_names, forced_bytes);
  }

  void add(const std::string& what, const std::string& how, const Names& which,
           const std::map<Id, std::string>& bytes) {
    PowerCut cut{.where = "before " + what + ", with " + how, .promised = promised};
    for (const auto& [name, id] : which) {
      const auto known = bytes.find(id);
      cut.files[name] = known == bytes.end() ? std::string() : known->second;
    }
    if (seen.emplace(cut.promised, cut.files).second) {
      cuts.push_back(std::move(cut));
    }
  }

  void created(int fd) {
    struct stat status {};
    if (::fstat(fd, &status) == 0) {
      ids[status.st_ino] = ++last_id;
    }
  }

  void forced(int fd, const fs::path& path) {
    struct stat status {};
    if (path == folder) {
      forced_names = names();
    } else if (has(path) && ::fstat(fd, &status) == 0) {
      forced_bytes[ids.try_emplace(status.st_ino, ++last_id).first->second] =
          content("/proc/self/fd/" + std::to_string(fd));
    }
  }

  fs::path folder;
  std::map<ino_t, Id> ids;
  Id last_id = 0;
  Names forced_names;
  std::map<Id, std::string> forced_bytes;
  unsigned promised = 0;
  std::vector<PowerCut> cuts;
  std::set<std::tuple<unsigned, std::map<std::string, std::string>>> seen;
};

namespace {

/// Calls `use` with the watched disk, if there is one, whose own changes do not count.
template <typename Use>
void with_disk(Use use) {
  if (looking) {
    return;
  }
  const std::lock_guard guard(lock);
  if (watching != nullptr) {
    looking = true;
    use(*watching);
    looking = false;
  }
}

void before(const char* what, const fs::path& file) {
  with_disk([&](PowerCutDisk::Impl& disk) {
    if (disk.has(file) || file == disk.folder) {
      disk.note(std::string(what) + " " + file.filename().string());
    }
  });
}

int open_watched(const char* function, const char* path, int flags, mode_t mode) {
  auto* const real = next<int(const char*, int, ...)>(function);
  bool creates = false;
  if ((flags & (O_CREAT | O_TRUNC)) != 0) {
    with_disk([&](PowerCutDisk::Impl& disk) {
      if (disk.has(path)) {
        creates = !fs::exists(path);
        disk.note("open " + fs::path(path).filename().string());
      }
    });
  }
  const int fd = real(path, flags, mode);
  if (creates && fd >= 0) {
    with_disk([&](PowerCutDisk::Impl& disk) { disk.created(fd); });
  }
  return fd;
}

int force_watched(const char* function, int fd) {
  const fs::path path = path_of(fd);
  before(function, path);
  bool watched = false;
  with_disk([&](PowerCutDisk::Impl& disk) {
    watched = disk.has(path) || path == disk.folder;
    disk.forced(fd, path);
  });
  if (!watched) {
    const std::lock_guard guard(lock);
    watched = path.parent_path() == restored || path == restored;
  }
  // The real disk need not force what a test checks; it would only take time.
  return watched ? 0 : next<int(int)>(function)(fd);
}

mode_t mode_in(int flags, std::va_list arguments) {
  return (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
}

}  // namespace

PowerCutDisk::PowerCutDisk(const fs::path& folder) : impl_(std::make_unique<Impl>(folder)) {
  const std::lock_guard guard(lock);
  watching = impl_.get();
}

PowerCutDisk::~PowerCutDisk() {
  const std::lock_guard guard(lock);
  watching = nullptr;
}

void PowerCutDisk::promise(unsigned number) {
  const std::lock_guard guard(lock);
  impl_->promised = number;
}

std::vector<PowerCut> PowerCutDisk::power_cuts() {
  std::vector<PowerCut> cuts;
  with_disk([&](Impl& disk) {
    disk.note("anything else");
    cuts = disk.cuts;
  });
  return cuts;
}

}  // namespace millrace::tests

// Replacements of the C library's functions, for the whole program.
extern "C" {

int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = millrace::tests::mode_in(flags, arguments);
  va_end(arguments);
  return millrace::tests::open_watched("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = millrace::tests::mode_in(flags, arguments);
  va_end(arguments);
  return millrace::tests::open_watched("open64", path, flags, mode);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  millrace::tests::before("write", millrace::tests::path_of(fd));
  return millrace::tests::next<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
}

ssize_t pwrite64(int fd, const void* bytes, size_t size, off64_t offset) {
  millrace::tests::before("pwrite", millrace::tests::path_of(fd));
  return millrace::tests::next<ssize_t(int, const void*, size_t, off64_t)>("pwrite64")(
      fd, bytes, size, offset);
}

int ftruncate(int fd, off_t size) noexcept {
  millrace::tests::before("ftruncate", millrace::tests::path_of(fd));
  return millrace::tests::next<int(int, off_t)>("ftruncate")(fd, size);
}

int ftruncate64(int fd, off64_t size) noexcept {
  millrace::tests::before("ftruncate", millrace::tests::path_of(fd));
  return millrace::tests::next<int(int, off64_t)>("ftruncate64")(fd, size);
}

int rename(const char* from, const char* to) noexcept {
  millrace::tests::before("rename", from);
  return millrace::tests::next<int(const char*, const char*)>("rename")(from, to);
}

int unlink(const char* path) noexcept {
  millrace::tests::before("unlink", path);
  return millrace::tests::next<int(const char*)>("unlink")(path);
}

/// The C library's remove() does not call the unlink() above.
int remove(const char* path) noexcept {
  millrace::tests::before("remove", path);
  return millrace::tests::next<int(const char*)>("remove")(path);
}

int fsync(int fd) {
  return millrace::tests::force_watched("fsync", fd);
}

int fdatasync(int fd) {
  return millrace::tests::force_watched("fdatasync", fd);
}

}  // extern "C"
