# `cmake --install`: the program, the data that it looks up next to itself (apps/shared/data_directory.h), and the
# descriptions of the emulated devices, which the program itself writes at build time.

include(GNUInstallDirs)
set(share "${CMAKE_INSTALL_DATADIR}/walkman-hil")

set(datasheets "${CMAKE_BINARY_DIR}/datasheets")
file(GLOB_RECURSE robot_files CONFIGURE_DEPENDS "${WALKMAN_ROOT}/urdf/*.urdf" "${WALKMAN_ROOT}/urdf/*.srdf"
     "${WALKMAN_ROOT}/urdf/*.yaml")
add_custom_command(
  OUTPUT "${datasheets}/written"
  COMMAND "${CMAKE_COMMAND}" -E rm -rf "${datasheets}"
  COMMAND "${CMAKE_COMMAND}" -E env "WALKMAN_DATA=${WALKMAN_ROOT}" $<TARGET_FILE:walkman-hil> export eds --out
          "${datasheets}/eds"
  COMMAND "${CMAKE_COMMAND}" -E env "WALKMAN_DATA=${WALKMAN_ROOT}" $<TARGET_FILE:walkman-hil> export dbc --out
          "${datasheets}/dbc"
  COMMAND "${CMAKE_COMMAND}" -E touch "${datasheets}/written"
  DEPENDS walkman-hil ${robot_files}
  COMMENT "Writing the EDS and DBC files of the emulated devices"
  VERBATIM)
add_custom_target(device_descriptions ALL DEPENDS "${datasheets}/written")

install(TARGETS walkman-hil RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(DIRECTORY "${WALKMAN_ROOT}/urdf/" DESTINATION "${share}/urdf"
        FILES_MATCHING REGEX "\\.(urdf|srdf|yaml|stl|obj|dae)$")
install(FILES "${WALKMAN_ROOT}/adaptation/parameters.yaml" "${WALKMAN_ROOT}/adaptation/head_at_home.yaml" "${WALKMAN_ROOT}/adaptation/look_around.yaml" DESTINATION "${share}/adaptation")
install(DIRECTORY "${WALKMAN_ROOT}/emulator/plant/actuators" DESTINATION "${share}/emulator/plant" FILES_MATCHING PATTERN "*.yaml")
install(PROGRAMS "${WALKMAN_ROOT}/apps/campaign/engine" DESTINATION "${share}/apps/campaign")
install(FILES "${WALKMAN_ROOT}/emulator/scene/model_error.yaml" DESTINATION "${share}/emulator/scene")
install(FILES "${WALKMAN_ROOT}/emulator/camera/multisense.yaml" DESTINATION "${share}/emulator/camera")
install(DIRECTORY "${WALKMAN_ROOT}/emulator/nodes/measuring" DESTINATION "${share}/emulator/nodes" FILES_MATCHING PATTERN "*.yaml")
install(DIRECTORY "${datasheets}/eds" "${datasheets}/dbc" DESTINATION "${share}")
