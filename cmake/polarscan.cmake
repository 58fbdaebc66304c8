# polarscan_library(NAME DEPENDS...): the static library of this folder, from every .cpp file in it.
function(polarscan_library name)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(NOT sources)
    file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/empty.cpp "")
    set(sources ${CMAKE_CURRENT_BINARY_DIR}/empty.cpp)
  endif()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/polarscan>)
  target_link_libraries(${name} PUBLIC ${ARGN})
  polarscan_warnings(${name})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME polarscan_${name})
  install(TARGETS ${name} EXPORT polarscan ARCHIVE COMPONENT development)
  install(DIRECTORY . DESTINATION include/polarscan/${name} COMPONENT development FILES_MATCHING PATTERN "*.h")
endfunction()

# polarscan_precompile(TARGET FIRST HEADERS...): what nearly every source includes is parsed once, for all targets with the
# same FIRST (which comes before them) and the same compile options. Not with ccache, which is faster without.
function(polarscan_precompile target first)
  if(NOT POLARSCAN_PCH)
    return()
  endif()
  if(NOT ${target} STREQUAL ${first})
    target_precompile_headers(${target} REUSE_FROM ${first})
    return()
  endif()
  target_precompile_headers(${target} PRIVATE <Eigen/Dense> <algorithm> <array> <atomic> <chrono> <cmath> <filesystem>
    <fmt/format.h> <fmt/ranges.h> <fstream> <functional> <limits> <map> <memory> <mutex> <nlohmann/json.hpp> <numbers>
    <numeric> <optional> <random> <set> <span> <string> <thread> <vector> ${ARGN})
endfunction()

# polarscan_left_out(OPTION WHY): a part whose packages are not installed; with its OPTION ON that is an error.
function(polarscan_left_out option why)
  if(${option} STREQUAL AUTO)
    message(NOTICE "polarscan: left out: ${why}")
  else()
    message(FATAL_ERROR "${why}")
  endif()
endfunction()

function(polarscan_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
                         $<$<BOOL:${POLARSCAN_WERROR}>:-Werror>)
  if(POLARSCAN_WERROR)  # four warnings give false alarms inside of std::string and Eigen with g++ 12
    target_compile_options(${target} PRIVATE -Wno-error=restrict -Wno-error=maybe-uninitialized -Wno-error=stringop-overflow
                           -Wno-error=array-bounds)
  endif()
endfunction()

# polarscan_compile_fast(TARGET): a test's own code computes little, so the time that compiling it takes is what counts.
function(polarscan_compile_fast target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# polarscan_tests(FOLDER DEPENDS...): one GoogleTest program from every .cpp below tests/FOLDER. Each test has a limit of its own.
function(polarscan_tests folder)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(${folder}_test ${sources})
  target_include_directories(${folder}_test PRIVATE ${folder})
  target_link_libraries(${folder}_test PRIVATE ${ARGN} GTest::gtest_main)
  target_compile_definitions(${folder}_test PRIVATE
    POLARSCAN_SHARED="${PROJECT_SOURCE_DIR}/../shared"
    POLARSCAN_PROGRAM="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/polarscan")
  polarscan_warnings(${folder}_test)
  polarscan_compile_fast(${folder}_test)
  polarscan_precompile(${folder}_test core_test <gtest/gtest.h>)
  gtest_discover_tests(${folder}_test TEST_PREFIX ${folder}. DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
