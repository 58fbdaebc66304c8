# What others install: find_package(polarscan) for C++ programs, and by cpack two Debian packages, polarscan (the program, its
# pages, the Python module) and libpolarscan-dev.
include(CMakePackageConfigHelpers)
set(config_folder lib/cmake/polarscan)
install(EXPORT polarscan NAMESPACE polarscan:: FILE polarscan-targets.cmake DESTINATION ${config_folder}
  COMPONENT development)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/polarscan-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/polarscan-config.cmake cmake/FindOpenCV.cmake ${CMAKE_BINARY_DIR}/polarscan-config-version.cmake
  DESTINATION ${config_folder} COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "polarscan")
set(CPACK_PACKAGE_CONTACT "Seed e75a7ce6 maintainers <maintainers@users.noreply.h-seed-e75a7ce6.example>")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)

# With Ninja, cpack builds nothing by itself. The libraries come with the program.
set(packaged polarscan documents polarscan_changelog libpolarscan-dev_changelog)
if(TARGET python_module)
  list(APPEND packaged python_module)
endif()
list(JOIN packaged " " packaged)
set(CPACK_INSTALL_COMMANDS "\"${CMAKE_COMMAND}\" --build \"${CMAKE_BINARY_DIR}\" --target ${packaged}")

set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME polarscan)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
file(READ packaging/description.txt CPACK_DEBIAN_PROGRAM_DESCRIPTION)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "colmap, bash-completion")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libpolarscan-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "Headers, static libraries and the files for find_package(polarscan).")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libtbb-dev, libopencv-imgcodecs-dev, libopencv-imgproc-dev, libopencv-calib3d-dev, libopencv-contrib-dev, \
libtiff-dev, libopenexr-dev, libembree-dev, libnanoflann-dev, libmeshoptimizer-dev, libaravis-dev, libusb-1.0-0-dev, libxxhash-dev, libhwy-dev, \
libsqlite3-dev, libceres-dev, libfmt-dev, nlohmann-json3-dev")
set(CPACK_COMPONENT_UNSPECIFIED_GROUP program)
set(CPACK_COMPONENT_PYTHON_GROUP program)
set(CPACK_COMPONENT_DEVELOPMENT_GROUP development)

# What Debian wants to find beside a package's files.
foreach(package polarscan libpolarscan-dev)
  set(folder ${CMAKE_BINARY_DIR}/doc/${package})
  configure_file(packaging/changelog ${folder}/changelog COPYONLY)
  configure_file(packaging/copyright ${folder}/copyright COPYONLY)
  add_custom_command(OUTPUT ${folder}/changelog.gz DEPENDS packaging/changelog
    COMMAND gzip -9nfk ${folder}/changelog VERBATIM)
  add_custom_target(${package}_changelog ALL DEPENDS ${folder}/changelog.gz)
endforeach()
install(FILES ${CMAKE_BINARY_DIR}/doc/polarscan/copyright ${CMAKE_BINARY_DIR}/doc/polarscan/changelog.gz
  DESTINATION share/doc/polarscan)
# Not with the permissions of the sources, which come from the umask of who fetched them.
install(DIRECTORY deploy/ DESTINATION share/doc/polarscan/examples
  DIRECTORY_PERMISSIONS ${CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS})
install(DIRECTORY docs/ DESTINATION share/doc/polarscan/docs
  DIRECTORY_PERMISSIONS ${CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS}
  FILES_MATCHING PATTERN "*.md" PATTERN "*.svg" PATTERN "*.png" PATTERN "*.jpg" PATTERN "read_session.py")
install(PROGRAMS deploy/slurm/submit-stereo DESTINATION share/doc/polarscan/examples/slurm)
install(FILES ${CMAKE_BINARY_DIR}/doc/libpolarscan-dev/copyright ${CMAKE_BINARY_DIR}/doc/libpolarscan-dev/changelog.gz
  DESTINATION share/doc/libpolarscan-dev COMPONENT development)

include(CPack)
cpack_add_component_group(program)
cpack_add_component_group(development)
