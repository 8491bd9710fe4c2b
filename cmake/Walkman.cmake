# Compiler settings shared by every target, and two helpers that keep the folders' CMake files short.
#
# No -march flags anywhere: Debian's PCL and KDL exchange Eigen types with this code, and a different vector
# width changes Eigen's allocation alignment (heap corruption).

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)

option(WALKMAN_WARNINGS_AS_ERRORS "Treat compiler warnings as errors" OFF)
set(WALKMAN_SANITIZE "" CACHE STRING "Sanitizers to compile with, as -fsanitize= takes them")

get_filename_component(WALKMAN_ROOT "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

# Paths below the source tree are hashed relative to it, so that every clone finds what another one compiled. A cache
# folder that cannot be written (a read-only home) must not stop the build: the cache is then in the build folder.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER env "CCACHE_BASEDIR=${WALKMAN_ROOT}" CCACHE_SLOPPINESS=pch_defines,time_macros
      "${CCACHE_PROGRAM}")
  execute_process(COMMAND "${CCACHE_PROGRAM}" --get-config cache_dir OUTPUT_VARIABLE ccache_folder ERROR_QUIET
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND mkdir -p "${ccache_folder}" ERROR_QUIET)
  execute_process(COMMAND test -w "${ccache_folder}" RESULT_VARIABLE ccache_not_writable)
  if(ccache_not_writable)
    list(INSERT CMAKE_CXX_COMPILER_LAUNCHER 1 "CCACHE_DIR=${CMAKE_BINARY_DIR}/ccache")
  endif()
endif()

add_library(walkman_settings INTERFACE)
target_include_directories(walkman_settings INTERFACE "${WALKMAN_ROOT}")
target_compile_options(walkman_settings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                                                  -Woverloaded-virtual -Wcast-qual)
# Nobody reads errno after a square root, and with it loops that contain one cannot be vectorised.
target_compile_options(walkman_settings INTERFACE -fno-math-errno)
if(CMAKE_UNITY_BUILD)  # GCC treats the files of a batch as headers, whose types must not have members that are local to a file
  target_compile_options(walkman_settings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
if(WALKMAN_WARNINGS_AS_ERRORS)
  target_compile_options(walkman_settings INTERFACE -Werror)
endif()
if(WALKMAN_SANITIZE)
  target_compile_options(walkman_settings INTERFACE "-fsanitize=${WALKMAN_SANITIZE}" -fno-sanitize-recover=all
                                                    -fno-omit-frame-pointer)
  target_link_options(walkman_settings INTERFACE "-fsanitize=${WALKMAN_SANITIZE}")
  # Under a sanitizer Eigen allocates differently, and memory freed by Debian's PCL would come from the wrong allocator.
  target_compile_definitions(walkman_settings INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
if(WALKMAN_SANITIZE MATCHES "thread")
  # Waiting for TBB's tasks happens inside Debian's library, which the sanitizer does not see; with assertions enabled,
  # TBB's headers check the counter once more themselves before its memory, on the stack, is reused.
  target_compile_definitions(walkman_settings INTERFACE TBB_USE_ASSERT=1)
endif()

# Settings for the code of the tests themselves: little optimisation, and without the sanitizers' checks of every access
# to memory, which take half of the compile time and which the product's code has.
add_library(walkman_test_settings INTERFACE)
target_link_libraries(walkman_test_settings INTERFACE walkman_settings)
# At this level of optimisation, GCC 12 takes joined strings for overruns (its bugs 105329, 105651 and similar ones).
target_compile_options(walkman_test_settings INTERFACE $<$<CONFIG:Release>:-O1 -Wno-array-bounds -Wno-restrict
                                                           -Wno-stringop-overflow -Wno-stringop-overread>)
if(WALKMAN_SANITIZE MATCHES "undefined")
  target_compile_options(walkman_test_settings INTERFACE -fno-sanitize=null,alignment,object-size,vptr)
endif()

# walkman_precompiled(NAME SETTINGS LIBRARIES HEADERS...): headers that are compiled once, for targets that name
# walkman_NAME in target_precompile_headers(TARGET REUSE_FROM ...) and are compiled with the same settings.
function(walkman_precompiled name settings libraries)
  file(GENERATE OUTPUT "${CMAKE_BINARY_DIR}/precompiled/${name}.cpp" CONTENT "")
  add_library(walkman_${name} OBJECT "${CMAKE_BINARY_DIR}/precompiled/${name}.cpp")
  target_link_libraries(walkman_${name} PRIVATE ${settings} ${libraries})
  target_precompile_headers(walkman_${name} PRIVATE ${ARGN})
endfunction()

# walkman_library(NAME SOURCES... [PUBLIC targets...] [PRIVATE targets...]): a static library walkman_NAME,
# also known as walkman::NAME.
function(walkman_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(walkman_${name} STATIC ${ARG_SOURCES})
  add_library(walkman::${name} ALIAS walkman_${name})
  target_link_libraries(walkman_${name} PUBLIC walkman_settings ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  if(WALKMAN_SANITIZE)  # with release optimisation, GCC 12 would take joined strings for overruns
    target_precompile_headers(walkman_${name} REUSE_FROM walkman_library_headers)
  endif()
  # One section per function, so that the linker can tell which ones no program reaches (tests/house).
  target_compile_options(walkman_${name} PRIVATE -ffunction-sections)
endfunction()

# walkman_test(NAME SOURCES... LINK targets... [THREADED | STATISTICAL]): a GoogleTest program; each of its cases is one
# CTest test, except under a sanitizer, where the program is. Tests run in the source tree and name files relative to
# it, so that their objects are the same in every clone. Tests below tests/unit have the label unit, or threaded if they
# are for the thread sanitizer too, and are built by the target of that name (unit_tests builds both). Tests that run
# the same code for many seeds have the label statistical instead: a sanitizer would find nothing more there, at twenty
# times the cost.
add_custom_target(unit_tests)
add_custom_target(threaded_tests)
add_dependencies(unit_tests threaded_tests)
function(walkman_test name)
  cmake_parse_arguments(ARG "THREADED;STATISTICAL" "TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE walkman_test_settings ${ARG_LINK} GTest::gmock GTest::gtest_main)
  target_precompile_headers(${name} REUSE_FROM walkman_test_headers)
  target_compile_definitions(${name} PRIVATE WALKMAN_TEST_DATA="tests/data" WALKMAN_URDF_DIR="urdf"
                                             WALKMAN_SOURCE_TREE=".")
  set(label integration)
  if(ARG_THREADED)
    set(label threaded)
    add_dependencies(threaded_tests ${name})
  elseif(ARG_STATISTICAL)
    set(label statistical)
  elseif(CMAKE_CURRENT_SOURCE_DIR MATCHES "/tests/unit/")
    set(label unit)
    add_dependencies(unit_tests ${name})
  endif()
  if(WALKMAN_SANITIZE)  # a separate process for each case would cost more here than most cases
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 WORKING_DIRECTORY "${WALKMAN_ROOT}")
    set_tests_properties(${name} PROPERTIES TIMEOUT 1200 LABELS ${label})
  else()
    gtest_discover_tests(${name} WORKING_DIRECTORY "${WALKMAN_ROOT}" PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS ${label}
                         DISCOVERY_TIMEOUT 60)
  endif()
endfunction()
