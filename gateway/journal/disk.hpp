// The file system as the journal uses it; every failure as std::system_error with the path.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace millrace::gateway::journal {

/// An open file; closed at the end.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;

  [[nodiscard]] int number() const { return number_; }

 private:
  int number_ = -1;
};

/// Opens FOLDER/lock and takes it for this process. Fails if another process has it.
Descriptor lock_folder(const std::filesystem::path& folder);

/// The whole file; empty if there is none.
std::string read_file(const std::filesystem::path& file);

/// Writes all of it.
void write_all(const Descriptor& file, std::string_view bytes, const std::filesystem::path& name);

/// Forces the file to the disk.
void force(const Descriptor& file, const std::filesystem::path& name);

/// Begins FILE.new, which is to take the place of `file`, with these bytes; open for appending.
Descriptor begin_draft(const std::filesystem::path& file, std::string_view bytes);

/// Forces the draft to the disk and has it take the place of `file`, in one step even if the power
/// fails meanwhile.
void exchange(const Descriptor& draft, const std::filesystem::path& file);

}  // namespace millrace::gateway::journal
