# millrace_embed(OUT VARIABLE FILES path=file …): writes a source that defines embedded_files() (tools/web/http/embedded.hpp)
# with the bytes of these files; it sets VARIABLE to the name of that source. The assembler includes the bytes, not the compiler.
function(millrace_embed)
  cmake_parse_arguments(arg "" "OUT" "FILES" ${ARGN})
  set(blobs "")
  set(names "")
  set(rows "")
  set(inputs "")
  set(number 0)
  foreach(pair IN LISTS arg_FILES)
    string(REGEX MATCH "^([^=]*)=(.*)$" ignored "${pair}")
    set(path "${CMAKE_MATCH_1}")
    set(file "${CMAKE_MATCH_2}")
    list(APPEND inputs "${file}")
    set(symbol millrace_page_${number})
    string(APPEND blobs
      "    \".global ${symbol}\\n\" \"${symbol}:\\n\" \".incbin \\\"${file}\\\"\\n\"\n"
      "    \".global ${symbol}_end\\n\" \"${symbol}_end:\\n\" \".byte 0\\n\"\n")
    string(APPEND names "extern const char ${symbol}[];\nextern const char ${symbol}_end[];\n")
    string(APPEND rows "      {\"${path}\", {${symbol}, static_cast<std::size_t>(${symbol}_end - ${symbol})}},\n")
    math(EXPR number "${number} + 1")
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded_files.cpp)
  file(CONFIGURE OUTPUT ${source} @ONLY CONTENT [[
// Made by tools/web/http/embed.cmake.
#include <array>
#include <cstddef>

#include "tools/web/http/embedded.hpp"

asm(".pushsection .rodata\n"
@blobs@    ".popsection\n");

extern "C" {
@names@}

namespace millrace::tools::web::http {

std::span<const EmbeddedFile> embedded_files() {
  static const std::array<EmbeddedFile, @number@> files{{
@rows@  }};
  return files;
}

}  // namespace millrace::tools::web::http
]])
  set_source_files_properties(${source} PROPERTIES OBJECT_DEPENDS "${inputs}" SKIP_UNITY_BUILD_INCLUSION ON)
  set(${arg_OUT} ${source} PARENT_SCOPE)
endfunction()
