// Scenarios of an ADS client, the virtual CNC and its NC programs, as data files.
//
//   == a program that requests clears the old answer      a scenario begins with its title
//   config service_interface { reset_clears_states: true } settings that differ (textproto)
//   write 552 122301 4a "V.G.SERVICE.RESPONSE_STATE" 00 07 00 00 00
//   ok                                                     the response to the last request
//   run 1 V.G.SERVICE.REQUEST_STATE = 1                    channel 1 runs this program, \n = next
//                                                          block
//   read_write 552 122301 48 room 4 "V.G.SERVICE.RESPONSE_STATE" 00
//   = 00 00 00 00                                          the bytes of the response
//   read 552 122301 48
//   error 704
//
// Numbers are hexadecimal except ports, channels and room (the longest response, default 2048).
// Bytes are hexadecimal or quoted text, 61*127 repeats a byte. A comment begins with # at the start
// of a line, or after two blanks and before one.
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace millrace::cnc::simulator {

struct Scenario {
  /// tests/data/simulator/NAME.scenario
  std::string file;
  std::string title;
  struct Step {
    int line = 0;
    std::string text;
  };
  std::vector<Step> steps;

  friend std::ostream& operator<<(std::ostream& out, const Scenario& scenario) {
    return out << scenario.title;
  }
};

/// Every scenario of tests/data/simulator. Throws if there is none.
std::vector<Scenario> read_scenarios();

/// Plays it against its own virtual CNC with two channels. Returns the first deviation with file
/// and line, or an empty text.
std::string play(const Scenario& scenario);

}  // namespace millrace::cnc::simulator
