// The files of one recording, and earlier ones with its name.
//
//   Series series("run.mcap", Series::Files::many);
//   series.numbered(1)                        // "run-0001.mcap"
//   series.closed()                           // those that are there, the oldest first
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace millrace::tools::recorder {

class Series {
 public:
  enum class Files : std::uint8_t { one, many };

  /// With `prefix`, files that begin with it and a digit belong to the series too: recordings that
  /// are named by their time.
  Series(std::filesystem::path file, Files files, std::string prefix = "");

  /// The n-th file, from 1: "run.mcap" itself if there is only one, else "run-0001.mcap", …
  [[nodiscard]] std::filesystem::path numbered(unsigned number) const;
  /// The highest used number, of a closed file, a repaired one or a leftover; 0 if there is none.
  [[nodiscard]] unsigned last_number() const;
  /// Finished and repaired files, the oldest first.
  [[nodiscard]] std::vector<std::filesystem::path> closed() const;
  /// ".part" files that no process writes.
  [[nodiscard]] std::vector<std::filesystem::path> leftovers() const;

 private:
  struct Member {
    bool part = false;
    /// 0 if it has none.
    unsigned number = 0;
  };
  [[nodiscard]] std::optional<Member> member(const std::filesystem::path& file) const;
  template <typename Use>
  void for_each(Use use) const;

  std::filesystem::path file_;
  Files files_;
  std::string prefix_;
};

}  // namespace millrace::tools::recorder
