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

/// An NC program that a channel runs from the start.
struct Run {
  std::uint32_t channel = 0;
  std::filesystem::path file;
};

/// The flags as typed; an omitted flag is empty or has its default.
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

/// Declares the flags. Parsing `app` fills `options`, which must live as long as `app`.
void add_options(CLI::App& app, Options& options);

/// The flags together with the configuration file that they name.
struct Setup {
  ListenAddress listen;
  ads::NetId net_id;
  Settings settings;
  std::vector<Run> runs;
};

/// @throws base::program::UsageError for an invalid value
Setup resolve(const Options& options);

}  // namespace millrace::cnc::simulator
