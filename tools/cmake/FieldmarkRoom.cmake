include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Warnings are private to this project and never exported. Tests and kernels are spared the conversion warnings.
add_library(fieldmark_common_warnings INTERFACE)
target_compile_options(fieldmark_common_warnings INTERFACE
  $<$<CXX_COMPILER_ID:GNU,Clang>:-Wall -Wextra -Wpedantic -Wshadow -Wold-style-cast -Wnon-virtual-dtor
     $<$<BOOL:${FIELDMARK_WERROR}>:-Werror>>
  # GCC 12 warns of the standard library inlined at -O3, std::string first of all (its bug 105651).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:
     -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread>
  # In a unity build every source is included, and an anonymous namespace looks like that of a header.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-subobject-linkage>)
add_library(fieldmark_warnings INTERFACE)
target_link_libraries(fieldmark_warnings INTERFACE fieldmark_common_warnings)
target_compile_options(fieldmark_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU,Clang>:-Wconversion -Wsign-conversion>)

# fieldmark_room(<room> [MAY_USE <room>...] [UNITS <unit>...] [INTERNAL <unit>...] [PRIVATE <unit>...]
#                [HEADER_ONLY <unit>...] [KERNELS <unit>...] [PARTS <source>...] [ALONE <unit>...] [TESTS <test>...]
#                [COLD <unit>...] [LIBRARIES <private target>...] [NOT_INSTALLED])
#
# A room is a folder with a target of its own: room a/b is the target fieldmark_a_b, alias fieldmark::a_b. It sees the
# headers of the rooms that it MAY_USE, and of those that they use in their headers; any other header is not found.
#
# A unit u is a header, src/u.cpp and tests/ROOM/u_test.cpp; a unit whose test is missing does not configure.
#   UNITS     the header is include/fieldmark/ROOM/u.h: other rooms use it, and it is installed
#   INTERNAL  the same, not installed: for other rooms of this project alone
#   PRIVATE   the header is src/u.h: for this room alone
#   PARTS     sources in src/ that share a unit's header; TESTS: further tests in tests/ROOM/
# HEADER_ONLY names those of the units above that have no source; ALONE those whose source is never compiled together with
# others in a unity build (CMAKE_UNITY_BUILD, which halves the time of a build from scratch); COLD those that compute little,
# where the optimiser's higher levels take a third of the compile time and gain nothing.
#
# A kernel k is src/kernels/k.h + k.cpp with its test in tests/ROOM/kernels/k_test.cpp. Its source is compiled once for
# each instruction set in FIELDMARK_ISA_LEVELS and chosen at run time (fieldmark/engine/kernel.h).
set(FIELDMARK_ISA_LEVELS v2 v3 v4)
function(fieldmark_room room)
  cmake_parse_arguments(PARSE_ARGV 1 M "NOT_INSTALLED" ""
    "MAY_USE;UNITS;INTERNAL;PRIVATE;HEADER_ONLY;ALONE;COLD;KERNELS;PARTS;TESTS;LIBRARIES")
  string(REPLACE / _ name ${room})
  set(target fieldmark_${name})
  fieldmark_room_tests(${room})

  set(sources)
  set(cold)
  foreach(unit IN LISTS M_UNITS M_INTERNAL M_PRIVATE M_PARTS)
    if(unit IN_LIST M_COLD)
      list(APPEND cold src/${unit}.cpp)
    elseif(NOT unit IN_LIST M_HEADER_ONLY)
      list(APPEND sources src/${unit}.cpp)
    endif()
  endforeach()
  list(TRANSFORM M_ALONE REPLACE "(.+)" "src/\\1.cpp" OUTPUT_VARIABLE alone)
  set_source_files_properties(${alone} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  list(TRANSFORM M_UNITS REPLACE "(.+)" "include/fieldmark/${room}/\\1.h" OUTPUT_VARIABLE installed)
  fieldmark_kernels(${target} "${M_KERNELS}" kernels)

  add_library(${target} STATIC ${sources} ${kernels})
  add_library(fieldmark::${name} ALIAS ${target})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${installed})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> PRIVATE src)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -mtune=generic -fno-math-errno)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
  string(REPLACE / _ uses "${M_MAY_USE}")
  list(TRANSFORM uses PREPEND fieldmark_)
  # Eigen and other headers-only packages are used in sources only: BUILD_INTERFACE keeps them out of the exported interface.
  list(TRANSFORM M_LIBRARIES REPLACE "(.+)" "$<BUILD_INTERFACE:\\1>")
  target_link_libraries(${target} PUBLIC ${uses}
    PRIVATE $<BUILD_INTERFACE:fieldmark_warnings> ${M_LIBRARIES} OpenMP::OpenMP_CXX)
  if(cold)
    fieldmark_cold(${target} "${cold}" ${uses} ${M_LIBRARIES} fieldmark_warnings OpenMP::OpenMP_CXX)
  endif()
  if(M_NOT_INSTALLED)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_INSTALLED_ROOMS ${room})
  list(TRANSFORM installed PREPEND ${room}/)
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_INSTALLED_HEADERS ${installed})
  if(FIELDMARK_INSTALL)
    install(TARGETS ${target} EXPORT fieldmarkTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  endif()
endfunction()

# fieldmark_optional(<room> <NAME> <Debian packages> [LOADED] <pkg-config module>...)
#
# Lets a room use libraries that a machine may lack. Where they are installed, and unless FIELDMARK_WITH_<NAME> is off, the
# room's sources see FIELDMARK_WITH_<NAME>; elsewhere they name the packages. Packages are one word, joined by spaces. The
# libraries are linked, unless the sources load them when they need them (LOADED).
function(fieldmark_optional room name packages)
  cmake_parse_arguments(M "LOADED" "" "" ${ARGN})
  string(REPLACE / _ target fieldmark_${room})
  option(FIELDMARK_WITH_${name} "Use ${packages} where installed" ON)
  if(FIELDMARK_WITH_${name})
    pkg_check_modules(fieldmark_${name} QUIET IMPORTED_TARGET GLOBAL ${M_UNPARSED_ARGUMENTS})
  endif()
  if(NOT FIELDMARK_WITH_${name} OR NOT fieldmark_${name}_FOUND)
    message(STATUS "Fieldmark without ${packages}")
    return()
  endif()
  target_compile_definitions(${target} PRIVATE FIELDMARK_WITH_${name})
  if(M_LOADED)
    target_include_directories(${target} SYSTEM PRIVATE $<TARGET_PROPERTY:PkgConfig::fieldmark_${name},INTERFACE_INCLUDE_DIRECTORIES>)
    target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
    return()
  endif()
  target_link_libraries(${target} PRIVATE PkgConfig::fieldmark_${name})
  # What links an installed static library needs the optional ones too.
  set_property(GLOBAL APPEND_STRING PROPERTY FIELDMARK_OPTIONAL_PACKAGES
    "fieldmark_optional_package(fieldmark_${name} \"${packages}\" ${M_UNPARSED_ARGUMENTS})\n")
endfunction()

# Notes the tests of a room's units, and where they find its private headers, for the test program of its house: the
# first word of the room.
macro(fieldmark_room_tests room)
  list(TRANSFORM M_KERNELS PREPEND kernels/ OUTPUT_VARIABLE kernel_units)
  set(tests)
  foreach(unit IN LISTS M_UNITS M_INTERNAL M_PRIVATE M_TESTS kernel_units)
    set(test ${PROJECT_SOURCE_DIR}/tests/${room}/${unit}_test.cpp)
    if(NOT EXISTS ${test})
      message(FATAL_ERROR "unit '${room}/${unit}' has no test: write tests/${room}/${unit}_test.cpp")
    endif()
    list(APPEND tests ${test})
  endforeach()
  string(REGEX MATCH "^[^/]+" house ${room})
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_ROOMS ${room})
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_TESTS_${house} ${tests})
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_PRIVATE_${house} ${CMAKE_CURRENT_SOURCE_DIR}/src)
endmacro()

# Objects of sources that are compiled as the target is, but for the level of the optimiser.
# fieldmark_cold(<target> <sources> <library>...)
function(fieldmark_cold target sources)
  set(cold ${target}_cold)
  add_library(${cold} OBJECT ${sources})
  target_link_libraries(${cold} PRIVATE ${ARGN})
  target_compile_features(${cold} PRIVATE cxx_std_20)
  target_include_directories(${cold} PRIVATE $<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>)
  target_compile_definitions(${cold} PRIVATE $<TARGET_PROPERTY:${target},COMPILE_DEFINITIONS>)
  target_compile_options(${cold} PRIVATE $<TARGET_PROPERTY:${target},COMPILE_OPTIONS> $<$<CXX_COMPILER_ID:GNU,Clang>:-O1>)
  set_target_properties(${cold} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
  target_sources(${target} PRIVATE $<TARGET_OBJECTS:${cold}>)
endfunction()

# Objects of each kernel, one for each instruction set.
function(fieldmark_kernels target kernels result)
  set(objects)
  foreach(level IN LISTS FIELDMARK_ISA_LEVELS)
    foreach(kernel IN LISTS kernels)
      set(object ${target}_${kernel}_${level})
      add_library(${object} OBJECT src/kernels/${kernel}.cpp)
      target_compile_definitions(${object} PRIVATE FIELDMARK_ISA_NS=isa_${level})
      # -mno-mmx: GCC 12 moves 8 bytes through an MMX register of x86-64-v2, after which long double is NaN.
      target_compile_options(${object} PRIVATE -march=x86-64-${level} -mtune=generic -O3 -ffp-contract=fast
                             -fno-math-errno -fno-trapping-math -mno-mmx -Wno-psabi)
      target_compile_features(${object} PRIVATE cxx_std_20)
      target_include_directories(${object} PRIVATE src include ${PROJECT_SOURCE_DIR}/engine/include)
      target_link_libraries(${object} PRIVATE fieldmark_common_warnings)
      set_target_properties(${object} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF UNITY_BUILD OFF)
      list(APPEND objects $<TARGET_OBJECTS:${object}>)
    endforeach()
  endforeach()
  set(${result} ${objects} PARENT_SCOPE)
endfunction()

function(fieldmark_install_package)
  set(dir ${CMAKE_INSTALL_LIBDIR}/cmake/fieldmark)
  get_property(fieldmark_optional_packages GLOBAL PROPERTY FIELDMARK_OPTIONAL_PACKAGES)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/tools/cmake/fieldmarkConfig.cmake.in
    ${PROJECT_BINARY_DIR}/fieldmarkConfig.cmake INSTALL_DESTINATION ${dir})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/fieldmarkConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(EXPORT fieldmarkTargets NAMESPACE fieldmark:: DESTINATION ${dir})
  install(FILES ${PROJECT_BINARY_DIR}/fieldmarkConfig.cmake ${PROJECT_BINARY_DIR}/fieldmarkConfigVersion.cmake
          DESTINATION ${dir})
endfunction()
