// Test data in sections: several cases in one file, each with its expected result.
//
//   Lines before the first section say what the file is about.
//
//   == division_by_zero          a section: its name, then its main text
//   N10 P1 = 1 / 0
//   M30
//   -- expected                  another text of this section
//   0.000 aborted program.nc:1:1: …
//
// A line that begins with "== " or "-- " ends a text. Empty lines at the end of a section do not
// count. The lines of "-- NAME (CR LF)" end in CR LF; "-- NAME (no line end)" has none at its end.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace millrace::tests {

struct Section {
  std::string name;
  std::filesystem::path file;
  /// The line of its name.
  std::size_t line = 0;
  /// The main text has the name "".
  std::map<std::string, std::string> texts;

  [[nodiscard]] std::string place() const { return file.string() + ":" + std::to_string(line); }

  /// @throws std::runtime_error if the section has no text of this name
  [[nodiscard]] const std::string& text(const std::string& wanted = "") const {
    const auto found = texts.find(wanted);
    if (found == texts.end()) {
      throw std::runtime_error(place() + ": " + name + " has no text " + wanted);
    }
    return found->second;
  }
};

/// GoogleTest prints it if a test with this parameter fails.
inline std::ostream& operator<<(std::ostream& out, const Section& section) {
  return out << section.place();
}

inline std::vector<Section> read_sections(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw std::runtime_error("cannot read " + file.string());
  }
  std::vector<Section> sections;
  std::string name;
  std::string text;
  const auto end_text = [&](bool last_of_section) {
    while (last_of_section && (text == "\n" || text.ends_with("\n\n"))) {
      text.pop_back();
    }
    const std::string note = name.substr(std::min(name.find(" ("), name.size()));
    name.resize(name.size() - note.size());
    if (note == " (CR LF)") {
      for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) {
        text.insert(at, 1, '\r');
      }
    } else if (note == " (no line end)") {
      text.pop_back();
    } else if (!note.empty()) {
      throw std::runtime_error(file.string() + ": unknown note" + note);
    }
    if (!sections.empty() && !sections.back().texts.emplace(name, text).second) {
      throw std::runtime_error(sections.back().place() + ": two texts " + name);
    }
    text.clear();
  };
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const bool begins_section = line.starts_with("== ");
    if (begins_section || line.starts_with("-- ")) {
      end_text(begins_section);
      name = begins_section ? "" : line.substr(3);
      if (begins_section) {
        sections.push_back({line.substr(3), file, number, {}});
      }
    } else {
      text += line + '\n';
    }
  }
  end_text(true);
  return sections;
}

/// The sections of all files `*.txt` in a folder.
inline std::vector<Section> read_sections_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".txt") {
      files.push_back(entry.path());
    }
  }
  std::ranges::sort(files);
  std::vector<Section> sections;
  for (const auto& file : files) {
    std::ranges::move(read_sections(file), std::back_inserter(sections));
  }
  return sections;
}

}  // namespace millrace::tests
