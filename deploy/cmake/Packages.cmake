# Debian packages, one per role:
#
#   cmake --build --preset release && cpack --preset release      # into build/release/packages
#
# millrace-common   fabric.textproto, profiles, the target that all units belong to, documentation, schemas of all files
# millrace-gateway  the gateway, its unit and configuration
# millrace-services the services that come with millrace, the unit of a service, example configurations
# millrace-tools    the operator's command, the units of recorder and web page, alerts for Prometheus
# millrace-cnc      the virtual CNC and the demo
# libmillrace-sdk   the service library in C++ and with the vendor's names
# libmillrace1      the library of the C interface
# millrace-sdk-dev  headers and configuration to compile services with either library
# python3-millrace  services in Python
#
# Programs and library say by their own install() which component they belong to.
include(GNUInstallDirs)

set(millrace_deploy ${PROJECT_SOURCE_DIR}/deploy)
set(millrace_units lib/systemd/system)
set(millrace_share ${CMAKE_INSTALL_DATADIR}/millrace)
# Below the prefix, but for /usr, whose configurations are in /etc beside it. Which it is, is known when it is installed.
foreach(component IN ITEMS common gateway services)
  install(CODE [[
    set(millrace_etc etc/millrace)
    if(CMAKE_INSTALL_PREFIX MATCHES "/usr/?$")
      set(millrace_etc ../etc/millrace)
    endif()]] COMPONENT ${component})
endforeach()
set(millrace_etc "\${millrace_etc}")

# Together as in the source tree, so that links between pages, and to schemas, hold.
set(millrace_doc ${CMAKE_INSTALL_DATADIR}/doc/millrace-common)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/README.de.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_SOURCE_DIR}/CONTRIBUTING.md
  ${PROJECT_SOURCE_DIR}/SECURITY.md ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${millrace_doc} COMPONENT common)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${millrace_doc} COMPONENT common)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/idl DESTINATION ${millrace_doc} COMPONENT common
  FILES_MATCHING PATTERN "*.proto" PATTERN "*.idl" PATTERN lcm EXCLUDE)

install(FILES ${millrace_deploy}/systemd/millrace.target DESTINATION ${millrace_units} COMPONENT common)
# A link, so that a boot starts the target, and with it what is enabled, without a step that a user could forget.
install(DIRECTORY ${millrace_deploy}/systemd/multi-user.target.wants DESTINATION ${millrace_units} COMPONENT common)
install(DIRECTORY ${millrace_deploy}/profiles DESTINATION ${millrace_share} COMPONENT common)
# The additions for units with trust, their installer, and its folder.
install(FILES ${millrace_deploy}/systemd/trust.conf DESTINATION ${millrace_share}/systemd COMPONENT common)
install(PROGRAMS ${millrace_deploy}/install-trust DESTINATION ${millrace_share} COMPONENT common)
install(DIRECTORY DESTINATION ${millrace_etc}/trust COMPONENT common)
install(FILES ${millrace_deploy}/profiles/one_host.fabric.textproto DESTINATION ${millrace_etc}
  RENAME fabric.textproto COMPONENT common)

install(FILES ${millrace_deploy}/systemd/millrace-gateway.service DESTINATION ${millrace_units} COMPONENT gateway)
install(FILES ${millrace_deploy}/examples/gateway.textproto DESTINATION ${millrace_etc} COMPONENT gateway)

install(DIRECTORY
    ${millrace_deploy}/systemd/millrace-service@batch.service.d
    ${millrace_deploy}/systemd/millrace-service@dial-gauge.service.d
    ${millrace_deploy}/systemd/millrace-service@http.service.d
    ${millrace_deploy}/systemd/millrace-service@mail.service.d
  DESTINATION ${millrace_units} COMPONENT services)
install(FILES ${millrace_deploy}/systemd/millrace-service@.service DESTINATION ${millrace_units} COMPONENT services)
install(DIRECTORY ${millrace_deploy}/examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/millrace-services/examples
  COMPONENT services PATTERN gateway.textproto EXCLUDE PATTERN isg EXCLUDE PATTERN programs EXCLUDE PATTERN python EXCLUDE)
# For controllers whose programs use the services; SysServiceWait.cyc for those that have none of their own. On every
# host, because which one a user copies them from is open.
install(FILES ${PROJECT_SOURCE_DIR}/cnc/nc/cycles/MeasureWait.cyc ${PROJECT_SOURCE_DIR}/cnc/nc/cycles/SysServiceWait.cyc
  DESTINATION ${millrace_share}/cycles COMPONENT common)
# The input of lcm-gen for LCM programs.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/idl/lcm DESTINATION ${millrace_share} COMPONENT services)
install(DIRECTORY ${millrace_deploy}/examples/programs DESTINATION ${millrace_share} USE_SOURCE_PERMISSIONS
  COMPONENT services)
# The folder where units look for the flags of each instance.
install(DIRECTORY DESTINATION ${millrace_etc}/services COMPONENT services)
# The folder where the unit of the HTTP service looks for its secrets.
install(DIRECTORY DESTINATION ${millrace_etc}/http COMPONENT services)

install(FILES ${millrace_deploy}/systemd/millrace-recorder.service ${millrace_deploy}/systemd/millrace-web.service
  DESTINATION ${millrace_units} COMPONENT tools)
install(FILES ${millrace_deploy}/systemd/millrace-recorder.conf DESTINATION lib/tmpfiles.d COMPONENT tools)
# For a Prometheus and a Grafana, wherever they are.
install(DIRECTORY ${millrace_deploy}/prometheus DESTINATION ${millrace_share} COMPONENT tools)

install(PROGRAMS ${millrace_deploy}/demo DESTINATION ${millrace_share} COMPONENT cnc)
install(DIRECTORY ${millrace_deploy}/nc DESTINATION ${millrace_share} COMPONENT cnc)

# Pure Python, in the folder that Debian's python3 of every version searches.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/services/python/millrace DESTINATION lib/python3/dist-packages COMPONENT python
  FILES_MATCHING PATTERN "*.py" PATTERN py.typed PATTERN __pycache__ EXCLUDE)

install(DIRECTORY ${millrace_deploy}/examples/python/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-millrace/examples
  COMPONENT python PATTERN __pycache__ EXCLUDE)

set(millrace_components common gateway services tools cnc sdk sdk-dev c python)
foreach(component IN LISTS millrace_components)
  if(component STREQUAL "sdk")
    set(name libmillrace-sdk)
  elseif(component STREQUAL "c")
    set(name libmillrace1)
  elseif(component STREQUAL "python")
    set(name python3-millrace)
  else()
    set(name millrace-${component})
  endif()
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_FILE_NAME DEB-DEFAULT)
  # In each package, as Debian wants it.
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    RENAME copyright COMPONENT ${component})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL ${millrace_components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PACKAGE_NAME millrace)
set(CPACK_PACKAGE_VERSION ${MILLRACE_DEBIAN_VERSION})
set(CPACK_PACKAGE_VENDOR millrace)
set(CPACK_PACKAGE_CONTACT "The millrace maintainers <maintainers@millrace.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION misc)
# Libraries by what the programs are linked with; the rest by name.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(exactly "(= ${MILLRACE_DEBIAN_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_DEBIAN_COMMON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_GATEWAY_PACKAGE_DEPENDS "millrace-common ${exactly}")
set(CPACK_DEBIAN_SERVICES_PACKAGE_DEPENDS "millrace-common ${exactly}")
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "millrace-common ${exactly}")
set(CPACK_DEBIAN_SDK_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_SDK-DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_SDK-DEV_PACKAGE_DEPENDS
  "libmillrace-sdk ${exactly}, libmillrace1 ${exactly}")
# For services/sdk/command_line.hpp, services/text/fields.hpp and services/sdk/asio.hpp.
set(CPACK_DEBIAN_SDK-DEV_PACKAGE_RECOMMENDS "libcli11-dev, libexpected-dev, libspdlog-dev")
set(CPACK_DEBIAN_SDK-DEV_PACKAGE_SUGGESTS "libboost1.83-dev | libboost1.81-dev")
set(CPACK_DEBIAN_C_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), libmillrace1 ${exactly}")
# The certificates that vouch for mail and web servers.
set(CPACK_DEBIAN_SERVICES_PACKAGE_RECOMMENDS "ca-certificates")
# For its demo.
set(CPACK_DEBIAN_CNC_PACKAGE_RECOMMENDS "millrace-gateway, millrace-services")

set(CPACK_COMPONENT_COMMON_DESCRIPTION "millrace: what all its programs on a host share
 Profiles of the fabric, the systemd target of everything that is enabled, the
 documentation, and the schemas of configuration files and DDS topics.")
set(CPACK_COMPONENT_GATEWAY_DESCRIPTION "millrace gateway: the Service Interface of CNC channels on DDS
 Reads the controllers over ADS, by notifications or by polling, and dispatches
 each call of an NC program to one live instance of its service.")
set(CPACK_COMPONENT_SERVICES_DESCRIPTION "millrace services: square root, dial gauge, archiver, batch, HTTP, mail, LCM
 Programs that answer calls of NC programs, bridges to web servers and to programs that speak LCM,
 and the systemd unit of a service.")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "millrace: the operator's command
 Looks at a fabric, acts on it, records what happens and reads recordings; shows
 it in a browser and to Prometheus.")
set(CPACK_COMPONENT_CNC_DESCRIPTION "millrace virtual CNC: runs NC programs without a machine
 An interpreter of NC programs behind an ADS server, for tests and trials.")
set(CPACK_COMPONENT_SDK_DESCRIPTION "millrace service library
 What services of one's own are linked with.")
set(CPACK_COMPONENT_SDK-DEV_DESCRIPTION "millrace service libraries: headers, CMake and pkg-config files
 In C++, in C with the names of the vendor's SDK, and the C interface millrace.h.")
set(CPACK_COMPONENT_C_DESCRIPTION "millrace C interface
 Serves calls of NC programs, calls services and observes a fabric, for programs
 of any compiler and for python3-millrace.")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "millrace for Python: services for NC programs
 Serves, calls and watches, and tests services without a fabric.")
# CPack takes a variable of a component in upper case, a description in either.
foreach(component IN LISTS millrace_components)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${CPACK_COMPONENT_${upper}_DESCRIPTION}")
endforeach()

# Files under /etc that a user changed are kept; new units are known at once. No process is started, enabled or
# restarted: that is the operator's decision, one instance at a time.
set(scripts ${PROJECT_BINARY_DIR}/packaging)
set(units_common millrace.target)
set(units_gateway millrace-gateway.service)
set(units_services "'millrace-service@*.service'")
set(units_tools "millrace-recorder.service millrace-web.service")
set(conffiles_common "/etc/millrace/fabric.textproto\n")
set(conffiles_gateway "/etc/millrace/gateway.textproto\n")
foreach(component IN ITEMS common gateway services tools)
  string(TOUPPER ${component} upper)
  configure_file(${millrace_deploy}/package/reload_units ${scripts}/${component}/postinst COPYONLY)
  configure_file(${millrace_deploy}/package/reload_units ${scripts}/${component}/postrm COPYONLY)
  set(units ${units_${component}})
  configure_file(${millrace_deploy}/package/stop_units ${scripts}/${component}/prerm @ONLY)
  set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA
    ${scripts}/${component}/postinst ${scripts}/${component}/prerm ${scripts}/${component}/postrm)
  if(conffiles_${component})
    file(CONFIGURE OUTPUT ${scripts}/${component}/conffiles CONTENT "${conffiles_${component}}")
    list(APPEND CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA ${scripts}/${component}/conffiles)
  endif()
endforeach()
# A library of its own needs the loader to look.
file(CONFIGURE OUTPUT ${scripts}/sdk/triggers CONTENT "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_SDK_PACKAGE_CONTROL_EXTRA ${scripts}/sdk/triggers)
set(CPACK_DEBIAN_C_PACKAGE_CONTROL_EXTRA ${scripts}/sdk/triggers)
# Python compiles the package to byte code when it is installed.
configure_file(${millrace_deploy}/package/compile_python ${scripts}/python/postinst COPYONLY)
configure_file(${millrace_deploy}/package/clean_python ${scripts}/python/prerm COPYONLY)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${scripts}/python/postinst ${scripts}/python/prerm)

include(CPack)
