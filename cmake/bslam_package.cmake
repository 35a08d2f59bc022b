# The library that other projects link, and what `cmake --install` puts where: the program, the headers, the shared library,
# and files by which CMake (find_package(bslam)) and pkg-config find them.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# bslam_shared_library(USES layer): libbslam.so of that layer and everything below it, as target bslam::bslam. It exports
# what include/bslam marks. Eigen, OpenGV and yaml-cpp are inside or linked privately: nothing of them, and none of our
# compiler flags, reaches who links it.
function(bslam_shared_library)
  cmake_parse_arguments(ARG "" "USES" "" ${ARGN})
  add_library(bslam_library SHARED $<TARGET_OBJECTS:bslam_${ARG_USES}>)
  add_library(bslam::bslam ALIAS bslam_library)
  target_link_libraries(bslam_library PRIVATE bslam_${ARG_USES})
  target_include_directories(bslam_library PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                                  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(bslam_library PUBLIC cxx_std_17)
  set_target_properties(bslam_library PROPERTIES OUTPUT_NAME bslam EXPORT_NAME bslam VERSION ${PROJECT_VERSION}
                                                 SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
                                                 LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR} LINKER_LANGUAGE CXX)
  if(NOT BSLAM_SANITIZE AND NOT BSLAM_FUZZ)  # whose symbols come with the program
    target_link_options(bslam_library PRIVATE LINKER:--no-undefined)
  endif()
  # Symbols of other libraries stay inside, whatever visibility they were compiled with.
  target_link_options(bslam_library PRIVATE LINKER:--version-script=${PROJECT_SOURCE_DIR}/cmake/bslam.map)
  set_target_properties(bslam_library PROPERTIES LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/bslam.map)
endfunction()

function(bslam_install)
  set(package ${CMAKE_INSTALL_LIBDIR}/cmake/bslam)
  install(TARGETS bslam RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  install(TARGETS bslam_library EXPORT bslam_targets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/bslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
          FILES_MATCHING PATTERN *.h)
  install(EXPORT bslam_targets NAMESPACE bslam:: DESTINATION ${package} FILE bslamTargets.cmake COMPONENT development)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/bslamConfig.cmake.in ${PROJECT_BINARY_DIR}/bslamConfig.cmake
                                INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/bslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/bslamConfig.cmake ${PROJECT_BINARY_DIR}/bslamConfigVersion.cmake
          DESTINATION ${package} COMPONENT development)
  file(RELATIVE_PATH BSLAM_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/bslam.pc.in ${PROJECT_BINARY_DIR}/bslam.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/bslam.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
