#include "tools/recorder/series.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "tools/mcap/file.hpp"

namespace millrace::tools::recorder {

namespace fs = std::filesystem;

namespace {

/// ".repaired" or ".repaired-2".
bool is_repaired(std::string_view extension) {
  constexpr std::string_view repaired = ".repaired";
  if (!extension.starts_with(repaired)) {
    return false;
  }
  extension.remove_prefix(repaired.size());
  return extension.empty() ||
         (extension.front() == '-' && base::text::parse_number<unsigned>(extension.substr(1)));
}

}  // namespace

Series::Series(fs::path file, Files files, std::string prefix)
    : file_(std::move(file)), files_(files), prefix_(std::move(prefix)) {}

fs::path Series::numbered(unsigned number) const {
  if (files_ == Files::one) {
    return file_;
  }
  fs::path name = file_;
  return name.replace_filename(
      fmt::format("{}-{:04}{}", file_.stem().string(), number, file_.extension().string()));
}

std::optional<Series::Member> Series::member(const fs::path& file) const {
  fs::path name = file.filename();
  Member member;
  if (name.extension() == ".part") {
    member.part = true;
    name.replace_extension();
  }
  if (name.extension() != file_.extension()) {
    return std::nullopt;
  }
  name.replace_extension();
  if (is_repaired(name.extension().string())) {
    name.replace_extension();
  }
  const std::string stem = name.string();
  const std::string own = file_.stem().string();
  if (stem.starts_with(own + '-')) {
    if (const auto number = base::text::parse_number<unsigned>(stem.substr(own.size() + 1))) {
      member.number = *number;
      return member;
    }
  }
  const bool by_time = !prefix_.empty() && stem.starts_with(prefix_) &&
                       stem.size() > prefix_.size() && base::text::is_digit(stem[prefix_.size()]);
  return stem == own || by_time ? std::optional(member) : std::nullopt;
}

template <typename Use>
void Series::for_each(Use use) const {
  std::error_code none;
  const fs::path folder = file_.has_parent_path() ? file_.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const auto found = member(entry.path());
    if (found && entry.is_regular_file(none)) {
      use(entry, *found);
    }
  }
}

unsigned Series::last_number() const {
  unsigned last = 0;
  for_each([&](const fs::directory_entry&, const Member& member) {
    last = std::max(last, member.number);
  });
  return last;
}

std::vector<fs::path> Series::closed() const {
  std::vector<std::pair<fs::file_time_type, fs::path>> found;
  for_each([&](const fs::directory_entry& entry, const Member& member) {
    std::error_code gone;
    const auto written = entry.last_write_time(gone);
    if (!member.part && !gone) {
      found.emplace_back(written, entry.path());
    }
  });
  std::sort(found.begin(), found.end());
  std::vector<fs::path> files;
  files.reserve(found.size());
  for (auto& [written, file] : found) {
    files.push_back(std::move(file));
  }
  return files;
}

std::vector<fs::path> Series::leftovers() const {
  std::vector<fs::path> files;
  for_each([&](const fs::directory_entry& entry, const Member& member) {
    if (member.part && !mcap::is_being_written(entry.path())) {
      files.push_back(entry.path());
    }
  });
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace millrace::tools::recorder
