#include "cnc/nc/syntax/manual.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "cnc/nc/characters.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

// Longer names before shorter ones. Not here, since skipping them would change which blocks run:
// #IF, #ELSE, #ENDIF, #RT CYCLE.
constexpr std::array<ListedCommand, 105> listed_commands = {{
    {"ACHSE", ""},
    {"ACHSTAUSCH", ""},
    {"ACS", ""},
    {"ADD", ""},
    {"AKIMA", ""},
    {"ANG", ""},
    {"AX", ""},
    {"BACKWARD", ""},
    {"BCS", ""},
    {"BLOCKSEARCH", ""},
    {"CACHE", ""},
    {"CALL", "AX"},
    {"CAX", ""},
    {"CAXTRACK", ""},
    {"CHANNEL", "INIT", true},
    {"CHANNEL", ""},
    {"CHF", ""},
    {"CHR", ""},
    {"CLEAR", ""},
    {"COMMAND", ""},
    {"CONTOUR", ""},
    {"CONTROL", ""},
    {"CORNER", ""},
    {"CS", "ON", true},
    {"CS", "OFF", true},
    {"CS", ""},
    {"CYL", ""},
    {"DEL", ""},
    {"DISABLE", "AX"},
    {"DISTANCE", ""},
    {"DRIVE", ""},
    {"DYNAMIC", ""},
    {"DYN_WEIGHT", ""},
    {"ECS", ""},
    {"EDGE", ""},
    {"EDM", ""},
    {"ENABLE", "AX"},
    {"EXPL", ""},
    {"EXPORT", ""},
    {"FACE", ""},
    {"FGROUP", ""},
    {"FILE", "DELETE"},
    {"FILE", "EXIST"},
    {"FILE", "RENAME"},
    {"FILTER", ""},
    {"FRC", ""},
    {"FREE", ""},
    {"GANTRY", ""},
    {"GET", "CMDPOS", true},
    {"GET", ""},
    {"HANDWHEEL", ""},
    {"HSC", ""},
    {"IDENT", ""},
    {"INFO", ""},
    {"JOG", ""},
    {"KIN", ""},
    {"LOAD", ""},
    {"LOCK", ""},
    {"MACHINE", ""},
    {"MAIN", ""},
    {"MANUAL", ""},
    {"MCS", ""},
    {"MEAS", ""},
    {"MICROJOINT", ""},
    {"NIBBLE", ""},
    {"OPTIONAL", ""},
    {"OTC", ""},
    {"OVERRIDE", ""},
    {"PRESET", ""},
    {"PSET", ""},
    {"PTP", ""},
    {"PUNCH", ""},
    {"PUT", ""},
    {"RND", ""},
    {"ROTATION", ""},
    {"RTCP", ""},
    {"SAVE", ""},
    {"SCALE", ""},
    {"SEGMENTATION", ""},
    {"SET", "DEC", true},
    {"SET", "IPO", true},
    {"SET", ""},
    {"SIGNAL", ""},
    {"SINGLE", ""},
    {"SLOPE", ""},
    {"SPLINE", ""},
    {"START", ""},
    {"STROKE", ""},
    {"SUPPRESS", ""},
    {"TANGFEED", ""},
    {"TLC", ""},
    {"TOOL", ""},
    {"TRACK", ""},
    {"TRAFO", "ON", true},
    {"TRAFO", "OFF", true},
    {"TRAFO", ""},
    {"TRANSVELMIN", ""},
    {"TRC", ""},
    {"TURN", ""},
    {"UNLOCK", ""},
    {"VECTOR", ""},
    {"VOLCOMP", ""},
    {"WAIT", "INDP"},
    {"WAIT", "SYN"},
    {"WCS", ""},
}};

struct Range {
  int first;
  int last;
};

constexpr std::array<Range, 33> listed_g = {{
    {0, 5},     {8, 13},    {17, 23},   {25, 26},   {33, 33},   {40, 42},   {51, 61},
    {63, 63},   {66, 66},   {68, 71},   {74, 74},   {80, 102},  {106, 108}, {112, 112},
    {115, 117}, {129, 141}, {150, 151}, {159, 167}, {174, 174}, {193, 196}, {200, 202},
    {230, 231}, {233, 233}, {236, 239}, {260, 261}, {301, 303}, {310, 310}, {333, 334},
    {338, 339}, {351, 351}, {359, 360}, {800, 839}, {900, 901},
}};

constexpr std::array<Range, 13> value_g = {{
    {4, 4},
    {68, 68},
    {74, 74},
    {92, 92},
    {98, 99},
    {101, 102},
    {129, 134},
    {136, 136},
    {159, 159},
    {230, 231},
    {233, 233},
    {333, 334},
    {338, 339},
}};

template <class Ranges>
bool has(const Ranges& ranges, double function) {
  return function == std::floor(function) &&
         std::ranges::any_of(ranges, [function](const Range& range) {
           return range.first <= function && function <= range.last;
         });
}

}  // namespace

const ListedCommand* find_listed_command(std::string_view first, std::string_view second) {
  const auto* const found = std::ranges::find_if(listed_commands, [&](const ListedCommand& listed) {
    return same_word(listed.first, first) &&
           (listed.second.empty() || same_word(listed.second, second));
  });
  return found == listed_commands.end() ? nullptr : found;
}

bool is_listed_g(double function) {
  return has(listed_g, function);
}

bool calls_subprogram(double function) {
  constexpr std::array<Range, 2> calls{{{80, 89}, {800, 839}}};
  return has(calls, function);
}

bool takes_values(double function) {
  return has(value_g, function);
}

}  // namespace millrace::cnc::nc::syntax
