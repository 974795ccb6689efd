# The two ways a target is made in Volto, so that every folder's CMakeLists.txt is only its list of files and its link line.

add_library(volto_build_options INTERFACE)
target_compile_features(volto_build_options INTERFACE cxx_std_20)
target_compile_options(volto_build_options INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
                       $<$<BOOL:${VOLTO_WARNINGS_AS_ERRORS}>:-Werror> -fstack-protector-strong)
# a*b+c is never contracted behind our back: the same source gives the same bits in every build.
target_compile_options(volto_build_options INTERFACE -ffp-contract=off)
target_compile_definitions(volto_build_options INTERFACE $<$<CONFIG:Debug>:_GLIBCXX_ASSERTIONS>)
if(VOLTO_SANITIZE)
  target_compile_options(volto_build_options INTERFACE -fsanitize=${VOLTO_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(VOLTO_SANITIZE MATCHES "undefined")
    # A null pointer or a wrong object stops the program under AddressSanitizer anyway; asking at every access would add half to the
    # build's time.
    target_compile_options(volto_build_options INTERFACE -fno-sanitize=null,object-size,vptr)
  endif()
  target_link_options(volto_build_options INTERFACE -fsanitize=${VOLTO_SANITIZE})
endif()
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_EXTENSIONS OFF)
install(TARGETS volto_build_options EXPORT volto)

# volto_library(NAME SOURCES a.cpp ... LINK volto::rig Eigen3::Eigen PRIVATE_LINK x): static library volto_NAME, alias volto::NAME.
# Headers are included as "folder/header.h" from the repository root, and installed as <volto/folder/header.h>.
function(volto_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(volto_${name} STATIC ${ARG_SOURCES})
  add_library(volto::${name} ALIAS volto_${name})
  target_include_directories(volto_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/volto>)
  target_link_libraries(volto_${name} PUBLIC ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK} volto_build_options)
  set_target_properties(volto_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS volto_${name} EXPORT volto ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  file(GLOB headers CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.h")
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/volto/${folder})
endfunction()

set(VOLTO_TEST_TIMEOUT_S 120)
if(VOLTO_SANITIZE)
  set(VOLTO_TEST_TIMEOUT_S 900)  # many times slower, and slower again on a busy machine
endif()

# volto_test(NAME SOURCES a_test.cpp ... LINK volto::rig): one GoogleTest executable per folder; ctest names are FOLDER/Suite.Finding.
function(volto_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name}_test ${ARG_SOURCES})
  target_link_libraries(${name}_test PRIVATE ${ARG_LINK} volto_test_support GTest::gtest_main volto_build_options)
  # The libraries are what people run; the tests themselves need to be built quickly.
  target_compile_options(${name}_test PRIVATE $<$<CONFIG:Release>:-O1>)
  gtest_discover_tests(${name}_test TEST_PREFIX "${name}/" DISCOVERY_TIMEOUT 60 PROPERTIES LABELS ${name} TIMEOUT ${VOLTO_TEST_TIMEOUT_S})
endfunction()

# volto_fuzz_replay(FOLDER TARGET volto::rig): runs tests/fuzz/TARGET_fuzz.cpp on its corpus, whole and cut, as the plain test FOLDER/fuzz/TARGET;
# tests/fuzz runs the same with libFuzzer.
function(volto_fuzz_replay folder target library)
  add_executable(volto_${target}_replay ${PROJECT_SOURCE_DIR}/tests/fuzz/${target}_fuzz.cpp
                 ${PROJECT_SOURCE_DIR}/tests/fuzz/replay_main.cpp)
  target_link_libraries(volto_${target}_replay PRIVATE ${library} volto_build_options)
  add_test(NAME ${folder}/fuzz/${target} COMMAND volto_${target}_replay ${PROJECT_SOURCE_DIR}/tests/fuzz/corpus/${target})
  set_tests_properties(${folder}/fuzz/${target} PROPERTIES LABELS ${folder} TIMEOUT ${VOLTO_TEST_TIMEOUT_S})
endfunction()
