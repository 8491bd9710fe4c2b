# `cmake --install`: the program, the data it looks up beside itself (apps/data_directory.h), and the descriptions of
# the emulated devices, which the program itself writes at build time.

include(GNUInstallDirs)
set(share "${CMAKE_INSTALL_DATADIR}/walkman-hil")

set(device_files "${CMAKE_BINARY_DIR}/device_files")
file(GLOB_RECURSE robot_files CONFIGURE_DEPENDS "${WALKMAN_ROOT}/urdf/*.urdf" "${WALKMAN_ROOT}/urdf/*.srdf"
     "${WALKMAN_ROOT}/urdf/*.yaml")
add_custom_command(
  OUTPUT "${device_files}/written"
  COMMAND "${CMAKE_COMMAND}" -E rm -rf "${device_files}"
  COMMAND "${CMAKE_COMMAND}" -E env "WALKMAN_DATA=${WALKMAN_ROOT}" $<TARGET_FILE:walkman-hil> export eds --out
          "${device_files}/eds"
  COMMAND "${CMAKE_COMMAND}" -E env "WALKMAN_DATA=${WALKMAN_ROOT}" $<TARGET_FILE:walkman-hil> export dbc --out
          "${device_files}/dbc"
  COMMAND "${CMAKE_COMMAND}" -E touch "${device_files}/written"
  DEPENDS walkman-hil ${robot_files}
  COMMENT "Writing the EDS and DBC files of the emulated devices"
  VERBATIM)
add_custom_target(device_descriptions ALL DEPENDS "${device_files}/written")

install(TARGETS walkman-hil RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(DIRECTORY "${WALKMAN_ROOT}/urdf/" DESTINATION "${share}/urdf"
        FILES_MATCHING REGEX "\\.(urdf|srdf|yaml|stl|obj|dae)$")
install(FILES "${WALKMAN_ROOT}/adaptation/parameters.yaml" DESTINATION "${share}/adaptation")
install(DIRECTORY "${WALKMAN_ROOT}/emulator/plant/actuators" "${WALKMAN_ROOT}/emulator/plant/sensors"
        DESTINATION "${share}/emulator/plant")
install(FILES "${WALKMAN_ROOT}/drivers/robot/identities.yaml" DESTINATION "${share}/drivers/robot")
install(DIRECTORY "${WALKMAN_ROOT}/drivers/robot/pdo_layouts" DESTINATION "${share}/drivers/robot")
install(DIRECTORY "${device_files}/eds" "${device_files}/dbc" DESTINATION "${share}")
