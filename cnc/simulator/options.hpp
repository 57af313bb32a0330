// The command line of millrace-cnc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <spdlog/common.h>

#include "cnc/ads/address.hpp"
#include "cnc/simulator/settings.hpp"

namespace millrace::cnc::simulator {

/// A program to run in a channel from the start.
struct Run {
  std::uint32_t channel = 0;
  std::filesystem::path file;
};

/// As typed; what is left out is empty.
struct Options {
  std::string listen = "127.0.0.1:48898";
  std::string net_id = "127.0.0.1.1.1";
  std::optional<std::uint32_t> channels;
  std::vector<std::string> run;
  bool exit_when_idle = false;
  std::filesystem::path folder = ".";
  std::optional<double> speed;
  std::filesystem::path config;
  std::vector<std::filesystem::path> check;
  bool timings = false;
  spdlog::level::level_enum log_level = spdlog::level::info;
};

/// Declares the flags; `options` is filled when `app` is parsed and must live as long.
void add_options(CLI::App& app, Options& options);

/// What the flags mean together with the configuration file they name.
struct Setup {
  ListenAddress listen;
  ads::NetId net_id;
  Settings settings;
  std::vector<Run> runs;
};

/// @throws base::program::UsageError for a value that cannot be
Setup resolve(const Options& options);

}  // namespace millrace::cnc::simulator
