"""NMT: boot-up, states, commands (CiA 301 7.2.8)."""
from can_socket import Bus
from checks import equal, test, that, within
from limb import (HAND, JOINTS, NODES, PREOPERATIONAL, RESET_COMMUNICATION, RESET_NODE, SENSOR, START, STOP, equal_state)

A, B = JOINTS[0], JOINTS[1]
ERROR_CONTROL = [0x700 + node for node in NODES]


def boot_ups(frames):
    return sorted(frame.id - 0x700 for frame in frames if 0x700 < frame.id < 0x780 and frame.data == b"\0")


@test
def reset_node_of_all_gives_nine_boot_ups(limb):
    limb.bus.drain()
    limb.nmt(RESET_NODE)
    equal(boot_ups(limb.frames(0.5, *ERROR_CONTROL)), sorted(NODES), "boot-up messages")


@test
def reset_communication_of_all_gives_nine_boot_ups(limb):
    limb.fresh()
    limb.nmt(RESET_COMMUNICATION)
    equal(boot_ups(limb.frames(0.5, *ERROR_CONTROL)), sorted(NODES), "boot-up messages")


@test
def reset_of_one_node_boots_that_node_alone(limb):
    for command in (RESET_NODE, RESET_COMMUNICATION):
        for node in (A, SENSOR, HAND):
            limb.fresh()
            limb.nmt(command, node)
            equal(boot_ups(limb.frames(0.2)), [node], f"boot-ups after command {command:02X}")


@test
def after_boot_up_a_node_is_pre_operational(limb):
    limb.fresh()
    for node in NODES:
        equal_state(limb, node, 0x7F)


@test
def start_stop_and_pre_operational(limb):
    limb.fresh()
    for command, state in ((START, 0x05), (STOP, 0x04), (PREOPERATIONAL, 0x7F), (STOP, 0x04), (START, 0x05),
                           (PREOPERATIONAL, 0x7F)):
        limb.nmt(command, A)
        equal_state(limb, A, state)
        equal_state(limb, B, 0x7F)
    limb.nmt(START)
    for node in NODES:
        equal_state(limb, node, 0x05)


@test
def foreign_and_malformed_commands_are_ignored(limb):
    limb.fresh()
    limb.nmt(START, 99)
    limb.nmt(0x03, A)
    limb.bus.send(0x000, b"\x01")
    limb.bus.send(0x000, b"")
    limb.bus.send(0x000, b"\x01\x00", rtr=True)
    for node in NODES:
        equal_state(limb, node, 0x7F)


@test
def stopped_is_silent_but_for_error_control(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", 0x1017, 0, 50)
    limb.nmt(START, A)
    limb.bus.expect(0x700 + A, where=lambda frame: frame.data == b"\5", what="(operational)")
    limb.sync()
    limb.bus.expect(0x180 + A, what="(TPDO1 with SYNC)")
    limb.nmt(STOP, A)
    limb.bus.expect(0x700 + A, where=lambda frame: frame.data == b"\4", what="(stopped)")
    limb.bus.drain()
    sdo.send(bytes.fromhex("4000100000000000"))
    limb.sync()
    limb.bus.send(0x200 + A, b"\0")  # too short, which is reported as an error in another state
    frames = limb.frames(0.3)
    others = [frame for frame in frames if frame.id & 0x7F == A and frame.id != 0x700 + A]
    equal([hex(frame.id) for frame in others], [], "frames of a stopped node")
    within(sum(frame.id == 0x700 + A for frame in frames), 4, 8, "heartbeats in 0.3 s")
    limb.nmt(PREOPERATIONAL, A)
    limb.bus.expect(0x700 + A, where=lambda frame: frame.data == b"\x7F", what="(pre-operational)")
    equal(sdo.u32(0x1000), 0x00020192, "device type")


@test
def pre_operational_has_sdo_but_no_pdo(limb):
    sdo = limb.fresh(A)
    limb.sync()
    limb.bus.send(0x200 + A, bytes.fromhex("0600080000"))
    frames = limb.frames(0.2, 0x180 + A, 0x280 + A, 0x380 + A, 0x480 + A)
    equal(len(frames), 0, "TPDOs in pre-operational")
    equal(sdo.u16(0x6040), 0, "controlword after an RPDO in pre-operational")


@test
def reset_communication_restores_1000h_to_1FFFh_only(limb):
    sdo = limb.fresh(A)
    factory = sdo.u16(0x1017), sdo.u32(0x6085)
    sdo.put("<H", 0x1017, 0, 333)
    sdo.put("<I", 0x6085, 0, factory[1] + 7)
    limb.nmt(RESET_COMMUNICATION, A)
    limb.await_boot([A])
    equal((sdo.u16(0x1017), sdo.u32(0x6085)), (factory[0], factory[1] + 7), "1017h, 6085h after reset communication")
    limb.nmt(RESET_NODE, A)
    limb.await_boot([A])
    equal((sdo.u16(0x1017), sdo.u32(0x6085)), factory, "1017h, 6085h after reset node")


@test
def nmt_startup_object(limb):
    sdo = limb.fresh(A)
    that(sdo.u32(0x1F80) in (0, 4), f"1F80h is {sdo.u32(0x1F80):#x}, expected 0 or 4")


@test
def a_bus_left_out_is_not_served(limb):
    with Bus("vcan0") as torso:
        torso.send(0x000, b"\x81\x00")
        that(torso.receive(0.3) is None, "a node answers on an interface that --can does not name")
