urdf: walkman.urdf
srdf: walkman.srdf
devices: walkman.devices.yaml
identities: walkman.identities.yaml
pdo_layouts:
  - {name: a, file: pdo_layouts/layout_a.yaml}
  - {name: b, file: pdo_layouts/layout_b.yaml}
  - {name: c, file: pdo_layouts/layout_c.yaml}
  - {name: d, file: pdo_layouts/layout_d.yaml}
  - {name: e, file: pdo_layouts/layout_e.yaml}
pdo_layout: a
hands:
  - name: right
    shoulder: RShr
    frame: r_hand_grasp
    motor: r_handj_synergy
    force_torque: r_arm_ft
    joints: [RShSag, RShLat, RShYaw, RElbj, RForearmPlate, RWrj1, RWrj2]
    posture: right_arm_at_work
    continuous_torque_nm: {RShSag: 45, RShLat: 45, RShYaw: 45, RElbj: 45, RForearmPlate: 20, RWrj1: 20, RWrj2: 20}
    ranges:
      - {joint: RElbj, lower_rad: -2.9, upper_rad: -0.25}
  - name: left
    shoulder: LShr
    frame: l_hand_grasp
    motor: l_handj_synergy
    force_torque: l_arm_ft
    joints: [LShSag, LShLat, LShYaw, LElbj, LForearmPlate, LWrj1, LWrj2]
    posture: left_arm_at_work
    continuous_torque_nm: {LShSag: 45, LShLat: 45, LShYaw: 45, LElbj: 45, LForearmPlate: 20, LWrj1: 20, LWrj2: 20}
    ranges:
      - {joint: LElbj, lower_rad: -2.9, upper_rad: -0.25}
torso:
  joints: [WaistLat, WaistSag, WaistYaw]
  posture: upright
  ranges:
    - {joint: WaistLat, lower_rad: -0.349, upper_rad: 0.349}
    - {joint: WaistSag, lower_rad: -0.349, upper_rad: 0.349}
    - {joint: WaistYaw, lower_rad: -0.349, upper_rad: 0.349}
camera:
  optical_frame: multisense/left_camera_optical_frame
  pan: NeckYawj
  tilt: NeckPitchj
  imu: multisense/head_imu_link
  laser:
    frame: multisense/head_hokuyo_frame
    spindle: hokuyo_joint
stance:
  feet: [l_leg_ft, r_leg_ft]
  imu: imu_link
  twist: WaistYaw
