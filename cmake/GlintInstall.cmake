# The installed package: libraries, headers, and what CMake and pkg-config need to find them.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/glint)
install(TARGETS glint_c EXPORT glint-c LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS glint_math glint_model glint_query glint_formats glint_reader glint_api EXPORT glint-cxx
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT glint-c NAMESPACE glint:: FILE glint-c.cmake DESTINATION ${package_dir})
install(EXPORT glint-cxx NAMESPACE glint:: FILE glint-cxx.cmake DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/glint-config.cmake.in ${PROJECT_BINARY_DIR}/glint-config.cmake
  INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change the C++ interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/glint-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/glint-config.cmake ${PROJECT_BINARY_DIR}/glint-config-version.cmake DESTINATION ${package_dir})

# Headers keep their rooms. Those that say that they are private stay here, and so do those of the writer, whose library is not installed.
foreach(room libglint/math libglint/model libglint/query libglint/api formats)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${room}/*.h)
  get_filename_component(room_name ${room} NAME)
  foreach(header IN LISTS headers)
    file(STRINGS ${header} private REGEX "^// Private to ")
    if(NOT private AND NOT header MATCHES "/(glint|asset_writer|streamed_writer)\\.h$")
      file(RELATIVE_PATH name ${PROJECT_SOURCE_DIR}/${room} ${header})
      get_filename_component(folder ${name} DIRECTORY)
      install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/glint/${room_name}/${folder})
    endif()
  endforeach()
endforeach()
install(FILES ${PROJECT_SOURCE_DIR}/libglint/api/glint.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/formats/SPEC.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

# pkg-config files name their folder relative to their own, so that the prefix may be moved.
file(RELATIVE_PATH pc_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
foreach(name glint glint-static)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
