# The OpenCV modules that are asked for, as targets opencv_NAME. Debian's libopencv-dev has a config file for CMake but
# installs 200 packages more than the modules that we use; their own -dev packages come without one. aruco is a module
# of its own before OpenCV 4.7, and a part of objdetect since.
find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
set(aruco_library opencv_aruco)
if(OpenCV_INCLUDE_DIR)
  file(READ ${OpenCV_INCLUDE_DIR}/opencv2/core/version.hpp OpenCV_version_header)
  string(REGEX REPLACE ".*define CV_VERSION_MAJOR +([0-9]+).*define CV_VERSION_MINOR +([0-9]+).*" "\\1.\\2"
         OpenCV_VERSION "${OpenCV_version_header}")
  if(OpenCV_VERSION VERSION_GREATER_EQUAL 4.7)
    set(aruco_library opencv_objdetect)
  endif()
endif()
set(required_variables OpenCV_INCLUDE_DIR)
foreach(module ${OpenCV_FIND_COMPONENTS})
  if(module STREQUAL aruco)
    find_library(OpenCV_aruco_LIBRARY ${aruco_library})
  else()
    find_library(OpenCV_${module}_LIBRARY opencv_${module})
  endif()
  list(APPEND required_variables OpenCV_${module}_LIBRARY)
endforeach()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCV REQUIRED_VARS ${required_variables}
  REASON_FAILURE_MESSAGE "scripts/install-deps installs it")

if(OpenCV_FOUND)
  foreach(module ${OpenCV_FIND_COMPONENTS})
    if(NOT TARGET opencv_${module})
      add_library(opencv_${module} UNKNOWN IMPORTED)
      set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION ${OpenCV_${module}_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${OpenCV_INCLUDE_DIR})
    endif()
  endforeach()
endif()
