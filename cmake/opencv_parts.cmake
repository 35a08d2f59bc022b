# The few OpenCV modules in use, from their own Debian packages: the CMake package of libopencv-dev would pull in all of
# them with GUI, GDAL development files and VTK. Defines targets opencv::core, opencv::imgproc, and those of the tests:
# imgcodecs, features2d, flann, calib3d.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
if(NOT OPENCV_INCLUDE_DIR)
  message(FATAL_ERROR "OpenCV headers not found: install libopencv-imgproc-dev")
endif()
function(opencv_part name)
  find_library(OPENCV_LIB_${name} opencv_${name})
  if(OPENCV_LIB_${name})
    add_library(opencv::${name} UNKNOWN IMPORTED)
    set_target_properties(opencv::${name} PROPERTIES IMPORTED_LOCATION ${OPENCV_LIB_${name}}
                                                     INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
  endif()
endfunction()
foreach(part core imgproc imgcodecs features2d flann calib3d)
  opencv_part(${part})
endforeach()
