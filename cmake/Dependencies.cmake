# Third-party libraries, each as one imported target whose headers are system headers. docs/architecture.md gives the
# purpose of each.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(assimp REQUIRED)
find_package(embree 3 REQUIRED)
find_package(PNG REQUIRED)
find_package(TBB REQUIRED COMPONENTS tbb)
find_package(Boost REQUIRED)
find_package(GTest)
find_package(benchmark)

pkg_check_modules(urdfdom REQUIRED IMPORTED_TARGET urdfdom)
pkg_check_modules(kdl REQUIRED IMPORTED_TARGET orocos-kdl)

# The double-precision build of Bullet; the plain "Bullet" package is single precision, and the two cannot be mixed.
pkg_check_modules(bullet REQUIRED IMPORTED_TARGET bullet-float64)

# PCL's own CMake package pulls VTK, Qt and more into every consumer, and its pkg-config files pull in MPI and OpenNI;
# only these libraries are used.
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.13 pcl-1.14 pcl-1.15 REQUIRED)
add_library(walkman_pcl INTERFACE)
target_include_directories(walkman_pcl SYSTEM INTERFACE "${PCL_INCLUDE_DIR}")
foreach(component registration surface features filters segmentation search kdtree io common)
  find_library(PCL_${component}_LIBRARY pcl_${component} REQUIRED)
  mark_as_advanced(PCL_${component}_LIBRARY)
  target_link_libraries(walkman_pcl INTERFACE "${PCL_${component}_LIBRARY}")
endforeach()
target_link_libraries(walkman_pcl INTERFACE Eigen3::Eigen Threads::Threads)
add_library(PCL::PCL ALIAS walkman_pcl)

# Optional: another engine, for comparison.
find_package(mujoco QUIET)
