# find_package(surfrecon) -> surfrecon::surfrecon (shared), surfrecon::static
#
# Installed to PREFIX/share/cmake/surfrecon; finds the library relative to itself, so that the prefix can be moved.

get_filename_component(_surfrecon_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT TARGET surfrecon::surfrecon)
  add_library(surfrecon::surfrecon SHARED IMPORTED)
  set_target_properties(surfrecon::surfrecon PROPERTIES
    IMPORTED_LOCATION "${_surfrecon_prefix}/lib/${CMAKE_SHARED_LIBRARY_PREFIX}surfrecon${CMAKE_SHARED_LIBRARY_SUFFIX}"
    INTERFACE_INCLUDE_DIRECTORIES "${_surfrecon_prefix}/include")
endif()

if(NOT TARGET surfrecon::static AND EXISTS "${_surfrecon_prefix}/lib/libsurfrecon.a")
  find_package(Threads REQUIRED)
  add_library(surfrecon::static STATIC IMPORTED)
  set_target_properties(surfrecon::static PROPERTIES
    IMPORTED_LOCATION "${_surfrecon_prefix}/lib/libsurfrecon.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_surfrecon_prefix}/include"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;m;${CMAKE_DL_LIBS}")
endif()

unset(_surfrecon_prefix)
