"""CiA 402: the state machine, the modes, motion, and the drive's reaction when the master is lost."""
import math
import struct
import time

import drive
import pdo
from checks import equal, test, that, within
from drive import Cycle, await_state, reach
from limb import HAND, JOINTS, emergency

A = JOINTS[0]
WRIST = JOINTS[4]
CYCLIC_POSITION, CYCLIC_VELOCITY, CYCLIC_TORQUE, PROFILE_POSITION, PROFILE_VELOCITY, TORQUE, HOMING = 8, 9, 10, 1, 3, 4, 6
MASTER = 127


@test
def walk_up_and_down_over_sdo(limb):
    for node in (A, HAND):
        sdo = limb.fresh(node)
        limb.start(node)
        await_state(sdo, "switch on disabled")
        for word, expected in ((0x06, "ready to switch on"), (0x07, "switched on"), (0x0F, "operation enabled"),
                               (0x07, "switched on"), (0x06, "ready to switch on"), (0x00, "switch on disabled"),
                               (0x06, "ready to switch on"), (0x0F, "operation enabled"), (0x06, "ready to switch on"),
                               (0x07, "switched on"), (0x00, "switch on disabled"), (0x06, "ready to switch on"),
                               (0x02, "switch on disabled"), (0x06, "ready to switch on"), (0x07, "switched on"),
                               (0x02, "switch on disabled"), (0x06, "ready to switch on"), (0x0F, "operation enabled"),
                               (0x00, "switch on disabled")):
            reach(sdo, word, expected)


@test
def commands_that_mean_nothing_here(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    for word in (0x07, 0x0F, 0x02, 0x00, 0x80):
        sdo.put("<H", 0x6040, 0, word)
        limb.wait(0.02)
        equal(drive.state(sdo.u16(0x6041)), "switch on disabled", f"state after {word:04X}")


@test
def quick_stop_ends_in_switch_on_disabled(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    sdo.put("<h", 0x605A, 0, 2)
    reach(sdo, 0x06, "ready to switch on")
    reach(sdo, 0x0F, "operation enabled")
    reach(sdo, 0x02, "switch on disabled", 3.0)


@test
def quick_stop_that_stays(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    sdo.put("<h", 0x605A, 0, 6)
    reach(sdo, 0x06, "ready to switch on")
    reach(sdo, 0x0F, "operation enabled")
    reach(sdo, 0x02, "quick stop active", 3.0)
    limb.wait(0.3)
    equal(drive.state(sdo.u16(0x6041)), "quick stop active", "state")
    reach(sdo, 0x0F, "operation enabled")
    reach(sdo, 0x00, "switch on disabled")


@test
def statusword_bits(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    word = sdo.u16(0x6041)
    that(word & 0x0200, f"remote (bit 9) is not set: {word:04X}")
    that(word & 0x0010, f"voltage present (bit 4) is not set: {word:04X}")


@test
def modes_told_are_modes_there(limb):
    for node in (A, HAND):
        sdo = limb.fresh(node)
        modes = sdo.u32(0x6502)
        numbers = {0: 1, 1: 2, 2: 3, 3: 4, 5: 6, 6: 7, 7: 8, 8: 9, 9: 10}
        for bit, mode in numbers.items():
            if modes >> bit & 1:
                sdo.put("<b", 0x6060, 0, mode)
            else:
                sdo.refused((0x06090030, 0x06090031), sdo.put, "<b", 0x6060, 0, mode)
    return f"6502h = {modes:08X}"


@test
def objects_of_the_modes(limb):
    sdo = limb.fresh(A)
    for index, size in ((0x603F, 2), (0x6040, 2), (0x6041, 2), (0x605A, 2), (0x605B, 2), (0x605C, 2), (0x605D, 2), (0x605E, 2),
                        (0x6007, 2), (0x6060, 1), (0x6061, 1), (0x6062, 4), (0x6063, 4), (0x6064, 4), (0x6065, 4), (0x6066, 2),
                        (0x6067, 4), (0x6068, 2), (0x606B, 4), (0x606C, 4), (0x6071, 2), (0x6072, 2), (0x6074, 2), (0x6075, 4),
                        (0x6076, 4), (0x6077, 2), (0x6078, 2), (0x6079, 4), (0x607A, 4), (0x607C, 4), (0x607F, 4), (0x6080, 4),
                        (0x6081, 4), (0x6083, 4), (0x6084, 4), (0x6085, 4), (0x6086, 2), (0x6098, 1), (0x609A, 4), (0x60A8, 4),
                        (0x60A9, 4), (0x60B0, 4), (0x60B1, 4), (0x60B2, 2), (0x60F4, 4), (0x60FD, 4), (0x60FF, 4), (0x6402, 2),
                        (0x6502, 4)):
        equal(len(sdo.upload(index)), size, f"size of {index:04X}h")
    for index, subs in ((0x607D, (1, 2)), (0x6099, (1, 2)), (0x60C2, (1, 2)), (0x60E4, (1,)), (0x60C1, (1,)), (0x2010, (1, 2, 3, 4)),
                        (0x2020, (1, 2, 3)), (0x2030, (1, 2)), (0x2050, (1,)), (0x608F, (1, 2)), (0x6091, (1, 2)), (0x6092, (1, 2))):
        for sub in subs:
            sdo.upload(index, sub)
    equal((sdo.u32(0x60A8), sdo.u32(0x60A9)), (0xFA100000, 0xFA100300), "60A8h, 60A9h")


@test(seconds=40)
def cyclic_position_moves_the_joint(limb):
    """Moves 0.2 rad in a second, with a set-point every 5 ms, and back."""
    limb.fresh(WRIST)
    cycle = Cycle(limb, WRIST, CYCLIC_POSITION)
    cycle.prepare()
    cycle.enable()
    equal(cycle.mode_shown, CYCLIC_POSITION, "6061h in TPDO1")
    start = cycle.position
    for sign in (1, -1):
        begin = cycle.position
        for at in range(1, 201):
            cycle.position = begin + sign * int(200000 * (1 - math.cos(math.pi * at / 200)) / 2)
            cycle.step()
        cycle.step(60)
        within(cycle.position_actual, cycle.position - 20000, cycle.position + 20000, "6064h at the end of the motion, urad")
    within(max(one[2] for one in cycle.history if one[2] is not None) - start, 180000, 220000, "reach of the motion, urad")
    equal(drive.state(cycle.statusword), "operation enabled", "state")
    that(cycle.statusword & 0x1000, f"bit 12, follows the set-point, is not set: {cycle.statusword:04X}")
    equal([drive.state(one[1]) for one in cycle.history if drive.state(one[1]) == "fault"], [], "faults on the way")


@test(seconds=40)
def profile_position_by_its_handshake(limb):
    sdo = limb.fresh(WRIST)
    limb.start(WRIST)
    sdo.put("<b", 0x6060, 0, PROFILE_POSITION)
    sdo.put("<I", 0x6081, 0, 300000)
    reach(sdo, 0x06, "ready to switch on")
    reach(sdo, 0x0F, "operation enabled")
    target = sdo.i32(0x6064) + 100000
    sdo.put("<i", 0x607A, 0, target)
    sdo.put("<H", 0x6040, 0, 0x1F)
    ends = time.monotonic() + 1
    while not sdo.u16(0x6041) & 0x1000:
        that(time.monotonic() < ends, "the set-point is not acknowledged (bit 12)")
    sdo.put("<H", 0x6040, 0, 0x0F)
    ends = time.monotonic() + 4
    while sdo.u16(0x6041) & 0x1400 != 0x0400:
        that(time.monotonic() < ends, f"target not reached (bit 10): {sdo.u16(0x6041):04X}, {sdo.i32(0x6064) - target} urad off")
    within(sdo.i32(0x6064), target - 20000, target + 20000, "6064h")
    sdo.put("<H", 0x6040, 0, 0)


@test(seconds=40)
def profile_velocity_turns_and_halts(limb):
    sdo = limb.fresh(WRIST)
    limb.start(WRIST)
    sdo.put("<b", 0x6060, 0, PROFILE_VELOCITY)
    sdo.put("<i", 0x60FF, 0, 200000)
    reach(sdo, 0x06, "ready to switch on")
    reach(sdo, 0x0F, "operation enabled")
    limb.wait(0.7)
    within(sdo.i32(0x606C), 150000, 250000, "606Ch, urad/s")
    sdo.put("<H", 0x6040, 0, 0x010F)
    limb.wait(0.7)
    within(sdo.i32(0x606C), -30000, 30000, "606Ch after halt, urad/s")
    sdo.put("<H", 0x6040, 0, 0)


@test
def homing_on_the_current_position(limb):
    sdo = limb.fresh(WRIST)
    limb.start(WRIST)
    sdo.put("<b", 0x6060, 0, HOMING)
    sdo.put("<b", 0x6098, 0, 37)
    reach(sdo, 0x06, "ready to switch on")
    reach(sdo, 0x0F, "operation enabled")
    sdo.put("<H", 0x6040, 0, 0x1F)
    ends = time.monotonic() + 2
    while sdo.u16(0x6041) & 0x3400 != 0x1400:
        that(time.monotonic() < ends, f"homing not attained (bits 10, 12): {sdo.u16(0x6041):04X}")
    within(sdo.i32(0x6064) - sdo.i32(0x607C), -20000, 20000, "6064h - 607Ch")
    sdo.put("<H", 0x6040, 0, 0)


@test(seconds=40)
def following_error_is_a_fault_that_an_edge_resets(limb):
    limb.fresh(WRIST)
    cycle = Cycle(limb, WRIST, CYCLIC_POSITION)
    sdo = cycle.prepare()
    sdo.put("<I", 0x6065, 0, 1000)
    sdo.put("<H", 0x6066, 0, 10)
    cycle.enable()
    cycle.position += 300000
    cycle.until("fault", 400)
    codes = [struct.unpack_from("<H", one.data)[0] for one in cycle.others if one.id == 0x080 + WRIST and len(one.data) == 8]
    that(0x8611 in codes, f"no EMCY 8611h, only {[f'{code:04X}' for code in codes]}")
    cycle.position = None
    cycle.controlword = 0
    cycle.step(20)
    equal(sdo.u16(0x603F), 0x8611, "603Fh")
    equal(drive.state(cycle.statusword), "fault", "state without a reset")
    cycle.controlword = 0x80
    cycle.until("switch on disabled")
    cycle.step(20)
    equal(sdo.u8(0x1001), 0, "1001h after the reset")


@test(seconds=40)
def a_reset_bit_that_stays_resets_once(limb):
    limb.fresh(WRIST)
    cycle = Cycle(limb, WRIST, CYCLIC_POSITION)
    sdo = cycle.prepare()
    sdo.put("<I", 0x6065, 0, 1000)
    sdo.put("<H", 0x6066, 0, 10)
    cycle.enable()
    cycle.position += 300000
    cycle.controlword = 0x8F  # bit 7 is already set when the fault occurs
    cycle.until("fault", 400)
    cycle.position = None
    cycle.step(40)
    equal(drive.state(cycle.statusword), "fault", "state with bit 7 as a level")
    cycle.controlword = 0x00
    cycle.step(4)
    cycle.controlword = 0x80
    cycle.until("switch on disabled")


@test(seconds=40)
def quick_stop_when_the_master_is_gone(limb):
    """Heartbeat consumer, 6007h = 3, 1029h:1 = 1: the statusword in TPDO1, which the drive sends here every 5 ms, shows
    the quick stop within the consumer time and one cycle."""
    sdo = limb.fresh(WRIST)
    pdo.disable(sdo, 0x1800)
    sdo.put("<B", 0x1800, 2, 255)
    sdo.put("<H", 0x1800, 5, 5)
    pdo.enable(sdo, 0x1800)
    cycle = Cycle(limb, WRIST, CYCLIC_POSITION)
    cycle.prepare()
    sdo.put("<B", 0x1029, 1, 1)
    sdo.put("<h", 0x6007, 0, 3)
    sdo.put("<h", 0x605A, 0, 6)
    sdo.put("<I", 0x1016, 1, MASTER << 16 | 100)
    cycle.enable()
    for _ in range(12):
        limb.bus.send(0x700 + MASTER, b"\5")
        cycle.step(4)
    limb.bus.send(0x700 + MASTER, b"\5")
    last = limb.mark()
    cycle.history.clear()
    cycle.step(60)
    stopped = [one for one in cycle.history if drive.state(one[1]) != "operation enabled"]
    that(stopped, "the drive goes on without its master")
    equal(drive.state(stopped[0][1]), "quick stop active", "state after the loss")
    within((stopped[0][0] - last) * 1000, 94, 116, "ms from the last heartbeat to the statusword (100 and a cycle)")
    that([one for one in cycle.others if one.id == 0x080 + WRIST and emergency(0x8130)(one)], "no EMCY 8130h")


@test
def limits_of_position(limb):
    sdo = limb.fresh(A)
    low, high = sdo.i32(0x607D, 1), sdo.i32(0x607D, 2)
    that(low < high, f"607Dh: {low} to {high}")
    that(-7000000 < low and high < 7000000, f"607Dh in urad: {low} to {high}")


@test
def link_side_in_tpdo3(limb):
    sdo = limb.fresh(A)
    pdo.remap(sdo, 0x1802, [pdo.entry(0x60E4, 1, 32), pdo.entry(0x2020, 2, 32)], 1)
    limb.start(A)
    limb.bus.drain()
    limb.sync()
    data = limb.bus.expect(0x380 + A, what="(TPDO3)").data
    equal(len(data), 8, "length of TPDO3")
    within(pdo.i32(data) - sdo.i32(0x6064), -100000, 100000, "60E4h:1 - 6064h, urad (the spring's deflection)")
