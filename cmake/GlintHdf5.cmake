# PkgConfig::HDF5, the library of the asset files. With GLINT_STATIC_HDF5 its archive: the shared one brings libraries for the
# network along, which a wheel would carry.
option(GLINT_STATIC_HDF5 "Link HDF5 statically" OFF)
find_package(PkgConfig REQUIRED)
pkg_check_modules(HDF5 REQUIRED IMPORTED_TARGET hdf5)

if(GLINT_STATIC_HDF5)
  foreach(archive hdf5 sz aec z)
    find_library(GLINT_ARCHIVE_${archive} NAMES lib${archive}.a HINTS ${HDF5_LIBRARY_DIRS} ${HDF5_LIBDIR} REQUIRED)
    list(APPEND hdf5_archives ${GLINT_ARCHIVE_${archive}})
  endforeach()
  set_property(TARGET PkgConfig::HDF5 PROPERTY INTERFACE_LINK_LIBRARIES ${hdf5_archives} ${CMAKE_DL_LIBS} m)
endif()
