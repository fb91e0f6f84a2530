# Settings that every target of the project shares.

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)

# For whoever builds once: large headers are parsed once, and sources that agree on names are compiled together. Off for whoever changes
# sources: a change then compiles one of them, not its group, and ccache, which keeps no objects of precompiled headers, is used.
option(GLINT_FAST_FULL_BUILD "Precompile headers and compile sources together" ON)
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT GLINT_FAST_FULL_BUILD AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

# The gold linker is quicker with dozens of programs full of debug information.
if(CMAKE_BUILD_TYPE STREQUAL "Debug")
  include(CheckLinkerFlag)
  check_linker_flag(CXX "-fuse-ld=gold" GLINT_HAS_GOLD)
  if(GLINT_HAS_GOLD)
    add_link_options(-fuse-ld=gold)
  endif()
endif()

# Our own programs may use POPCNT and SSE4.2, which every x86 processor has had since 2009; kernels for newer ones are chosen at
# run time. The query headers take whatever the including program is compiled for, and look for AVX2 at run time.
set(GLINT_ARCH "x86-64-v2" CACHE STRING "-march of the programs and libraries on x86-64")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  add_compile_options($<$<COMPILE_LANGUAGE:C,CXX>:-march=${GLINT_ARCH}>)
endif()

# In the tree as in an installed package, headers are included as "glint/<room>/<header>.h", and the C interface as "glint.h".
set(GLINT_INCLUDE_DIR ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${GLINT_INCLUDE_DIR}/glint)
foreach(room math model query api bake)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/libglint/${room} ${GLINT_INCLUDE_DIR}/glint/${room} SYMBOLIC)
endforeach()
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/formats ${GLINT_INCLUDE_DIR}/glint/formats SYMBOLIC)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/libglint/api/glint.h ${GLINT_INCLUDE_DIR}/glint.h SYMBOLIC)

add_library(glint_warnings INTERFACE)
# GCC 12 sees overlaps in std::string that are not there (its bug 105329), and with precompiled headers texts of half the memory.
target_compile_options(glint_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -Wno-stringop-overflow>)

# Programs in C++ get the flag for C++20 from the targets. CMake refuses such a demand in projects without C++.
set(GLINT_STANDARD cxx_std_20)
if(NOT PROJECT_IS_TOP_LEVEL AND NOT GLINT_INCLUDER_HAS_CXX)
  set(GLINT_STANDARD "")
endif()

# The runtime of C++, for static libraries in programs that CMake links as C.
set(GLINT_CXX_RUNTIME stdc++)
if("c++" IN_LIST CMAKE_CXX_IMPLICIT_LINK_LIBRARIES)
  set(GLINT_CXX_RUNTIME c++)
endif()

# glint_add_library(<room> [INTERFACE])  makes target glint_<room> with alias glint::<room>
function(glint_add_library room)
  cmake_parse_arguments(ARG "INTERFACE" "" "SOURCES" ${ARGN})
  if(ARG_INTERFACE)
    add_library(glint_${room} INTERFACE)
    set(scope INTERFACE)
  else()
    add_library(glint_${room} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(glint_${room} PRIVATE $<BUILD_INTERFACE:glint_warnings>)
    target_compile_features(glint_${room} PRIVATE cxx_std_20)
    target_link_libraries(glint_${room} INTERFACE $<$<LINK_LANGUAGE:C>:${GLINT_CXX_RUNTIME}> $<$<LINK_LANGUAGE:C>:m>)
    set_target_properties(glint_${room} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  add_library(glint::${room} ALIAS glint_${room})
  target_compile_features(glint_${room} ${scope} ${GLINT_STANDARD})
  target_include_directories(glint_${room} ${scope}
    $<BUILD_INTERFACE:${GLINT_INCLUDE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  set_target_properties(glint_${room} PROPERTIES EXPORT_NAME ${room} CXX_EXTENSIONS OFF)
endfunction()

# Of headers that make each source that does not need them slower (CLI11, nlohmann-json): only where most sources do.
function(glint_precompile_headers owner)
  if(GLINT_FAST_FULL_BUILD)
    target_precompile_headers(${owner} PRIVATE ${ARGN})
  endif()
endfunction()

# Targets use the precompiled headers of the first one. They must be compiled with all of its definitions.
function(glint_share_precompiled_headers owner)
  if(GLINT_FAST_FULL_BUILD)
    foreach(target IN LISTS ARGN)
      target_precompile_headers(${target} REUSE_FROM ${owner})
    endforeach()
  endif()
endfunction()

# Sources of the targets are compiled in groups of so many (0: all as one), but for those with options of their own.
function(glint_compile_together group_size)
  if(GLINT_FAST_FULL_BUILD)
    set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${group_size})
  endif()
endfunction()
