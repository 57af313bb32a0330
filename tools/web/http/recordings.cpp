#include "tools/web/http/recordings.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

#include <boost/json/array.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/posix/files.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::web::http {

namespace {

constexpr std::string_view ending = ".mcap";
/// A longer list would be useless in a browser.
constexpr std::size_t most_listed = 10'000;

/// Stops reading a file: the request is satisfied or was dropped.
struct StopReading {};

struct Listed {
  std::string name;
  std::uint64_t size;
  fabric::Time modified;
};

fabric::Time time_of(const timespec& time) {
  return fabric::Time(std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec));
}

}  // namespace

Recordings::Result<base::posix::Fd> Recordings::open(const std::string& name) const {
  if (!name.ends_with(ending) || name.find('/') != std::string::npos) {
    return tl::unexpected(Refusal{
        404, fmt::format("{} is not a name of a recording; /api/recordings lists them", name)});
  }
  auto file = base::posix::open_beneath(folder_, name, O_RDONLY);
  if (!file) {
    return tl::unexpected(Refusal{404, fmt::format("{} cannot be read: {}; /api/recordings lists "
                                                   "what is there",
                                                   name, file.error())});
  }
  return std::move(*file);
}

Recordings::Result<mcap::FileSource> Recordings::source(const std::string& name) const {
  auto file = open(name);
  if (!file) {
    return tl::unexpected(std::move(file.error()));
  }
  auto source = mcap::FileSource::adopt(file->release(), name);
  if (!source) {
    return tl::unexpected(Refusal{404, std::move(source.error())});
  }
  return std::move(*source);
}

Recordings::Result<boost::json::object> Recordings::list() const {
  std::vector<Listed> found;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    struct stat status {};
    if (name.ends_with(ending) && !name.starts_with('.') && found.size() < most_listed &&
        ::lstat(entry->path().c_str(), &status) == 0 && S_ISREG(status.st_mode)) {
      found.push_back({name, static_cast<std::uint64_t>(status.st_size), time_of(status.st_mtim)});
    }
  }
  if (error) {
    return tl::unexpected(Refusal{503, fmt::format("the folder of the recordings cannot be read: "
                                                   "{}; see --recordings",
                                                   error.message())});
  }
  std::ranges::sort(found, std::ranges::greater(), &Listed::modified);
  boost::json::array list;
  for (const Listed& each : found) {
    boost::json::object object{{"name", print::utf8(each.name)}, {"size", each.size}};
    print::put_time(object, "modified", each.modified);
    list.push_back(std::move(object));
  }
  return boost::json::object{{"recordings", std::move(list)}};
}

Recordings::Result<boost::json::object> Recordings::info(const std::string& name) const {
  return source(name).map([&](mcap::FileSource file) {
    recording::HopStatistics hops;
    boost::json::object out = print::json_of(file.size(), mcap::survey(file));
    try {
      recording::read_entries(file, {}, [&](const recording::Entry& entry) {
        if (*stopped_) {
          throw StopReading();
        }
        hops.add(entry);
      });
    } catch (const StopReading&) {
      // stop() was called.
    }
    hops.close();
    out["hops"] = print::hops_json(hops);
    return out;
  });
}

Recordings::Result<boost::json::object> Recordings::calls(const std::string& name,
                                                          const plant::CallFilter& filter,
                                                          std::size_t skip,
                                                          std::size_t most) const {
  return source(name).map([&](mcap::FileSource file) {
    plant::CallStore call_store({.ended = 1, .failed = 0}, normal_);
    boost::json::array list;
    bool more = false;
    try {
      recording::read_entries(file, {}, [&](const recording::Entry& entry) {
        const plant::EndedCall* ended = call_store.add(entry);
        if (*stopped_) {
          throw StopReading();
        }
        if (ended == nullptr || !filter.takes(*ended) || (skip > 0 && skip-- > 0)) {
          return;
        }
        if (list.size() == most) {
          more = true;
          throw StopReading();
        }
        boost::json::object call = print::json_of(ended->call, ended->instance);
        call["failed"] = ended->failed;
        call["result"] = ended->result();
        list.push_back(std::move(call));
      });
    } catch (const StopReading&) {
      // The next page has the rest.
    }
    return boost::json::object{{"calls", std::move(list)}, {"more", more}};
  });
}

Recordings::Result<boost::json::object> Recordings::alarms(const std::string& name,
                                                           std::size_t most) const {
  return source(name).map([&](mcap::FileSource file) {
    boost::json::array list;
    bool more = false;
    try {
      recording::read_entries(file, {.kinds = {"alarm"}}, [&](const recording::Entry& entry) {
        if (*stopped_) {
          throw StopReading();
        }
        if (list.size() == most) {
          more = true;
          throw StopReading();
        }
        list.push_back(print::json_of(entry));
      });
    } catch (const StopReading&) {
      // The complete list is in the file.
    }
    return boost::json::object{{"alarms", std::move(list)}, {"more", more}};
  });
}

Recordings::Result<boost::json::object> Recordings::timeline(const std::string& name,
                                                             const fabric::CallId& call) const {
  return source(name).and_then([&](mcap::FileSource file) -> Result<boost::json::object> {
    recording::Call found(call);
    try {
      recording::read_entries(file, {.call = call}, [&](const recording::Entry& entry) {
        if (*stopped_) {
          throw StopReading();
        }
        found.add(entry);
      });
    } catch (const StopReading&) {
      // stop() was called.
    }
    const recording::Timeline timeline = recording::timeline_of(found);
    if (timeline.steps.empty()) {
      return tl::unexpected(
          Refusal{404, fmt::format("no call {} is in {}", call.to_string(), name)});
    }
    return print::json_of(timeline);
  });
}

Recordings::Result<Download> Recordings::download(const std::string& name) const {
  return open(name).and_then([&](base::posix::Fd file) -> Result<Download> {
    struct stat status {};
    if (::fstat(file.get(), &status) != 0) {
      return tl::unexpected(Refusal{503, base::posix::last_error("cannot read " + name)});
    }
    return Download{std::move(file), static_cast<std::uint64_t>(status.st_size), name};
  });
}

}  // namespace millrace::tools::web::http
