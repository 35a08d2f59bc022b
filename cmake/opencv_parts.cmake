# The few OpenCV modules in use, from their own Debian packages: the CMake package of libopencv-dev would pull in all of
# them with GUI, GDAL development files and VTK. Defines targets opencv::core, opencv::imgproc, and those of the tests:
# imgcodecs, features2d, flann, calib3d.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
if(NOT OPENCV_INCLUDE_DIR)
  message(FATAL_ERROR "OpenCV headers not found: install libopencv-imgproc-dev")
endif()
option(BSLAM_STATIC_OPENCV "take what is used of OpenCV from its archives, for packages" OFF)
function(opencv_part name)
  find_library(OPENCV_LIB_${name} opencv_${name})
  if(OPENCV_LIB_${name})
    add_library(opencv::${name} UNKNOWN IMPORTED)
    set_target_properties(opencv::${name} PROPERTIES IMPORTED_LOCATION ${OPENCV_LIB_${name}}
                                                     INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
  endif()
endfunction()
# The few functions in use, without the libraries that the shared modules load: LAPACK, X11 and Fortran, 20 MB. GLX belongs
# to functions that draw with OpenGL, which are not called.
function(opencv_archives)
  find_library(OPENCV_ARCHIVE_core libopencv_core.a)
  find_library(OPENCV_ARCHIVE_imgproc libopencv_imgproc.a)
  if(NOT OPENCV_ARCHIVE_core OR NOT OPENCV_ARCHIVE_imgproc)
    message(STATUS "no archives of OpenCV: its shared libraries are used")
    return()
  endif()
  set_target_properties(opencv::core PROPERTIES IMPORTED_LOCATION ${OPENCV_ARCHIVE_core}
    INTERFACE_LINK_LIBRARIES "z;tbb;dl;Threads::Threads"
    INTERFACE_LINK_OPTIONS "LINKER:--gc-sections;LINKER:--as-needed;LINKER:--defsym=glXGetProcAddressARB=0")
  set_target_properties(opencv::imgproc PROPERTIES IMPORTED_LOCATION ${OPENCV_ARCHIVE_imgproc}
    INTERFACE_LINK_LIBRARIES opencv::core)
endfunction()
foreach(part core imgproc imgcodecs features2d flann calib3d)
  opencv_part(${part})
endforeach()
if(BSLAM_STATIC_OPENCV)
  opencv_archives()
endif()
