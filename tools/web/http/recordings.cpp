#include "tools/web/http/recordings.hpp"

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/posix/files.hpp"
#include "base/text/ascii.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::web::http {

namespace {

constexpr std::string_view ending = ".mcap";
constexpr std::string_view ending_of_part = ".mcap.part";
/// A longer list would be useless in a browser.
constexpr std::size_t most_listed = 10'000;
/// Of the newest ones the list has more than name, size and time: each takes a few reads.
constexpr std::size_t most_described = 200;
/// The recorder first writes what the processes on the fabric had published before.
constexpr std::size_t entries_with_all_machines = 200;
/// A foreign file may name any number.
constexpr std::size_t most_machines = 100;

bool is_recording_name(std::string_view name) {
  return name.ends_with(ending) || name.ends_with(ending_of_part);
}

/// Reads entries until `use` returns false.
template <typename Use>
void read_while(mcap::Source& file, const recording::Filter& filter, const Use& use) {
  struct Stop {};
  try {
    recording::read_entries(file, filter, [&](const recording::Entry& entry) {
      if (!use(entry)) {
        throw Stop();
      }
    });
  } catch (const Stop&) {
    // The request is satisfied or was dropped.
  }
}

struct Listed {
  std::string name;
  std::uint64_t size;
  fabric::Time modified;
};

using Machines = std::set<std::string>;

void put_machines(boost::json::object& out, const Machines& machines) {
  boost::json::array names;
  for (const std::string& name : machines) {
    // A message queue belongs to its machine: "press.alarms".
    const std::size_t point = name.rfind('.');
    const bool is_queue = point != std::string::npos && machines.contains(name.substr(0, point));
    if (!is_queue && names.size() < most_machines) {
      names.emplace_back(print::utf8(name));
    }
  }
  out["machines"] = std::move(names);
}

fabric::Time time_of(mcap::Nanoseconds time) {
  return fabric::Time(std::chrono::nanoseconds(static_cast<std::int64_t>(time)));
}

/// From the summary of a finished file; nothing if that is missing or damaged.
void describe(boost::json::object& out, mcap::Source& file) {
  const auto summary = mcap::read_summary(file);
  if (!summary) {
    return;
  }
  if (summary->statistics.messages > 0) {
    print::put_time(out, "start", time_of(summary->statistics.start));
    print::put_time(out, "end", time_of(summary->statistics.end));
  }
  constexpr std::string_view begin = "machine/";
  Machines machines;
  for (const auto& [id, channel] : summary->definitions.channels()) {
    if (channel.topic.starts_with(begin)) {
      machines.insert(
          channel.topic.substr(begin.size(), channel.topic.find('/', begin.size()) - begin.size()));
    }
  }
  put_machines(out, machines);
  mcap::Problems ignored;
  for (const mcap::Metadata& metadata : mcap::read_metadata(file, *summary, ignored)) {
    if (metadata.name != print::recorder_metadata) {
      continue;
    }
    for (const auto& [key, name] :
         {std::pair(print::calls_ended, "calls"), std::pair(print::calls_failed, "failed")}) {
      const auto value = metadata.values.find(key);
      const auto number = value == metadata.values.end()
                              ? std::nullopt
                              : base::text::parse_number<std::uint64_t>(value->second);
      if (number) {
        out[name] = *number;
      }
    }
  }
}

/// From the beginning of a file that is not finished.
void describe_part(boost::json::object& out, mcap::Source& file) {
  Machines machines;
  std::size_t entries = 0;
  read_while(file, {}, [&](const recording::Entry& entry) {
    if (entries++ == 0) {
      print::put_time(out, "start", entry.at);
    }
    if (const auto* status = std::get_if<fabric::MachineStatus>(&entry.sample)) {
      machines.insert(status->machine);
    } else if (const fabric::ChannelKey* const key = recording::channel_of(entry);
               key != nullptr && !key->machine.empty()) {
      machines.insert(key->machine);
    }
    return entries < entries_with_all_machines;
  });
  put_machines(out, machines);
}

fabric::Time time_of(const timespec& time) {
  return fabric::Time(std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec));
}

}  // namespace

Recordings::Result<base::posix::Fd> Recordings::open(const std::string& name) const {
  if (!is_recording_name(name) || name.find('/') != std::string::npos) {
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
    if (is_recording_name(name) && !name.starts_with('.') && found.size() < most_listed &&
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
    const bool is_part = each.name.ends_with(ending_of_part);
    if (is_part) {
      object["writing"] = mcap::is_being_written(folder_ / each.name);
    }
    if (auto file = source(each.name); file && list.size() < most_described && !*stopped_) {
      is_part ? describe_part(object, *file) : describe(object, *file);
    }
    list.push_back(std::move(object));
  }
  return boost::json::object{{"recordings", std::move(list)}};
}

Recordings::Result<boost::json::object> Recordings::info(const std::string& name) const {
  return source(name).map([&](mcap::FileSource file) {
    recording::HopStatistics hops;
    boost::json::object out = print::json_of(file.size(), recording::survey(file));
    read_while(file, {}, [&](const recording::Entry& entry) {
      hops.add(entry);
      return !*stopped_;
    });
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
    read_while(file, {}, [&](const recording::Entry& entry) {
      const plant::EndedCall* ended = call_store.add(entry);
      if (*stopped_) {
        return false;
      }
      if (ended == nullptr || !filter.takes(*ended) || (skip > 0 && skip-- > 0)) {
        return true;
      }
      more = list.size() == most;
      if (more) {
        return false;
      }
      boost::json::object call = print::json_of(ended->call, ended->instance);
      call["failed"] = ended->failed;
      call["result"] = ended->result();
      list.push_back(std::move(call));
      return true;
    });
    return boost::json::object{{"calls", std::move(list)}, {"more", more}};
  });
}

Recordings::Result<boost::json::object> Recordings::alarms(const std::string& name,
                                                           std::size_t most) const {
  return source(name).map([&](mcap::FileSource file) {
    boost::json::array list;
    bool more = false;
    read_while(file, {.kinds = {"alarm"}}, [&](const recording::Entry& entry) {
      more = list.size() == most;
      if (more || *stopped_) {
        return false;
      }
      list.push_back(print::json_of(entry));
      return true;
    });
    return boost::json::object{{"alarms", std::move(list)}, {"more", more}};
  });
}

Recordings::Result<boost::json::object> Recordings::timeline(const std::string& name,
                                                             const fabric::CallId& call) const {
  return source(name).and_then([&](mcap::FileSource file) -> Result<boost::json::object> {
    recording::Call found(call);
    read_while(file, {.call = call}, [&](const recording::Entry& entry) {
      found.add(entry);
      return !*stopped_;
    });
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
