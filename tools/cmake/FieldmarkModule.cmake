include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Warnings are private to this project and never exported. Tests and kernels are spared the conversion warnings.
add_library(fieldmark_common_warnings INTERFACE)
target_compile_options(fieldmark_common_warnings INTERFACE
  $<$<CXX_COMPILER_ID:GNU,Clang>:-Wall -Wextra -Wpedantic -Wshadow -Wold-style-cast -Wnon-virtual-dtor
     $<$<BOOL:${FIELDMARK_WERROR}>:-Werror>>
  # GCC 12 warns of the standard library inlined at -O3, std::string first of all (its bug 105651).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:
     -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread>)
add_library(fieldmark_warnings INTERFACE)
target_link_libraries(fieldmark_warnings INTERFACE fieldmark_common_warnings)
target_compile_options(fieldmark_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU,Clang>:-Wconversion -Wsign-conversion>)

# fieldmark_module(<name> [DEPENDS <module>...] UNITS <unit>... [HEADER_ONLY <unit>...] [KERNELS <unit>...]
#                  [LIBRARIES <private target>...])
#
# A unit u of module m is three files: m/include/fieldmark/m/u.h, m/src/u.cpp and
# tests/m/u_test.cpp; a HEADER_ONLY unit has no .cpp. A unit whose test is missing does not configure.
# Each module has its own include/ root, so it can only include headers of what it DEPENDS on.
#
# A kernel k is a private m/src/kernels/k.h + k.cpp with its test in tests/m/kernels/k_test.cpp. Its .cpp is compiled once for
# each instruction set in FIELDMARK_ISA_LEVELS and chosen at run time (fieldmark/engine/isa.h).
set(FIELDMARK_ISA_LEVELS v2 v3 v4)
function(fieldmark_module name)
  cmake_parse_arguments(PARSE_ARGV 1 M "" "" "DEPENDS;UNITS;HEADER_ONLY;KERNELS;LIBRARIES")
  set(target fieldmark_${name})
  set(headers)
  set(sources)
  set(tests)
  list(TRANSFORM M_KERNELS PREPEND kernels/ OUTPUT_VARIABLE kernel_units)
  foreach(unit IN LISTS M_UNITS M_HEADER_ONLY kernel_units)
    set(test ${PROJECT_SOURCE_DIR}/tests/${name}/${unit}_test.cpp)
    if(NOT EXISTS ${test})
      message(FATAL_ERROR "unit '${name}/${unit}' has no test: write tests/${name}/${unit}_test.cpp")
    endif()
    list(APPEND tests ${test})
  endforeach()
  foreach(unit IN LISTS M_UNITS M_HEADER_ONLY)
    list(APPEND headers include/fieldmark/${name}/${unit}.h)
  endforeach()
  foreach(unit IN LISTS M_UNITS)
    list(APPEND sources src/${unit}.cpp)
  endforeach()
  set_property(GLOBAL APPEND PROPERTY FIELDMARK_MODULES ${name})
  set_property(GLOBAL PROPERTY FIELDMARK_TESTS_${name} ${tests})

  foreach(level IN LISTS FIELDMARK_ISA_LEVELS)
    foreach(kernel IN LISTS M_KERNELS)
      set(object ${target}_${kernel}_${level})
      add_library(${object} OBJECT src/kernels/${kernel}.cpp)
      target_compile_definitions(${object} PRIVATE FIELDMARK_ISA_NS=isa_${level})
      target_compile_options(${object} PRIVATE -march=x86-64-${level} -mtune=generic -O3 -ffp-contract=fast
                             -fno-math-errno -fno-trapping-math -Wno-psabi)
      target_compile_features(${object} PRIVATE cxx_std_20)
      target_include_directories(${object} PRIVATE src include ${PROJECT_SOURCE_DIR}/engine/include)
      target_link_libraries(${object} PRIVATE fieldmark_common_warnings)
      set_target_properties(${object} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
      list(APPEND sources $<TARGET_OBJECTS:${object}>)
    endforeach()
  endforeach()

  add_library(${target} STATIC ${sources})
  add_library(fieldmark::${name} ALIAS ${target})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${headers})
  target_include_directories(${target} PRIVATE src)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O3> -mtune=generic -fno-math-errno)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
  list(TRANSFORM M_DEPENDS PREPEND fieldmark_)
  # Eigen and other headers-only packages are used in .cpp files only: BUILD_INTERFACE keeps them out of the exported interface.
  list(TRANSFORM M_LIBRARIES REPLACE "(.+)" "$<BUILD_INTERFACE:\\1>")
  target_link_libraries(${target} PUBLIC ${M_DEPENDS}
    PRIVATE $<BUILD_INTERFACE:fieldmark_warnings> ${M_LIBRARIES} OpenMP::OpenMP_CXX)
  if(FIELDMARK_INSTALL)
    install(TARGETS ${target} EXPORT fieldmarkTargets FILE_SET HEADERS
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  endif()
endfunction()

function(fieldmark_install_package)
  set(dir ${CMAKE_INSTALL_LIBDIR}/cmake/fieldmark)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/tools/cmake/fieldmarkConfig.cmake.in
    ${PROJECT_BINARY_DIR}/fieldmarkConfig.cmake INSTALL_DESTINATION ${dir})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/fieldmarkConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(EXPORT fieldmarkTargets NAMESPACE fieldmark:: DESTINATION ${dir})
  install(FILES ${PROJECT_BINARY_DIR}/fieldmarkConfig.cmake ${PROJECT_BINARY_DIR}/fieldmarkConfigVersion.cmake
          DESTINATION ${dir})
endfunction()
