# Targets: ringwing::ringwing, the shared library, and ringwing::static.
get_filename_component(_ringwing_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET ringwing::ringwing)
  add_library(ringwing::ringwing SHARED IMPORTED)
  set_target_properties(ringwing::ringwing PROPERTIES
    IMPORTED_LOCATION "${_ringwing_prefix}/lib/libringwing.so.1"
    IMPORTED_SONAME "libringwing.so.1"
    INTERFACE_INCLUDE_DIRECTORIES "${_ringwing_prefix}/include")
endif()

# A Debian package has no static library.
if(NOT TARGET ringwing::static AND EXISTS "${_ringwing_prefix}/lib/libringwing.a")
  add_library(ringwing::static STATIC IMPORTED)
  set_target_properties(ringwing::static PROPERTIES
    IMPORTED_LOCATION "${_ringwing_prefix}/lib/libringwing.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_ringwing_prefix}/include"
    INTERFACE_LINK_LIBRARIES "gcc_s;util;rt;pthread;m;dl")
endif()

unset(_ringwing_prefix)
