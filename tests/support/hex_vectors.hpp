// Wire bytes as data files: hex with its meaning.
//
//   == read_request          a vector begins with its name
//   00 00  2c 00 00 00       # kind ads, 44 bytes follow; a comment ends with its line
//   "V.G.X" 00               # quoted text stands for its bytes
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace millrace::tests {

using HexVectors = std::map<std::string, std::vector<std::uint8_t>>;

/// The vectors of tests/data/`file`; throws with file and line for anything else in it.
HexVectors read_hex_vectors(const std::string& file);

/// One vector of such a file; throws if it is not there.
std::vector<std::uint8_t> hex_vector(const std::string& file, const std::string& name);

}  // namespace millrace::tests
