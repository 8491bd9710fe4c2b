"""PDOs: transmission types, timers, mapping at run time (CiA 301 7.2.2, 7.5.2.35 to .38)."""
import struct

import pdo
from checks import equal, test, that, within
from limb import HAND, JOINTS, SENSOR, START, emergency

A = JOINTS[0]
RPDO1, RPDO2, TPDO1, TPDO2 = 0x1400, 0x1401, 0x1800, 0x1801
STATUSWORD, MODE_SHOWN, LINK_VOLTAGE = pdo.entry(0x6041, 0, 16), pdo.entry(0x6061, 0, 8), pdo.entry(0x6079, 0, 32)
WRONG_STATE = (0x06010002, 0x08000022)


def count(limb, can_id, duration=0.1):
    return len(limb.frames(duration, can_id))


def only(limb, record, kind, **more):
    """Makes node A operational with only this TPDO valid and of this type."""
    sdo = limb.fresh(A)
    pdo.quiet(sdo)
    sdo.put("<B", record, 2, kind)
    if "inhibit" in more:
        sdo.put("<H", record, 3, more["inhibit"])
    if "event" in more:
        sdo.put("<H", record, 5, more["event"])
    sdo.put("<I", record, 1, more.get("cob_id", 0x180 + A | pdo.NO_RTR))
    limb.start(A)
    return sdo


@test
def factory_tpdos_answer_sync(limb):
    limb.fresh()
    limb.nmt(START)
    limb.wait(0.05)
    for _ in range(3):
        limb.bus.drain()
        limb.sync()
        frames = limb.frames(0.1)
        for node in JOINTS:
            equal([len(one.data) for one in frames if one.id == 0x180 + node], [5], f"TPDO1 of node {node}")
            equal([len(one.data) for one in frames if one.id == 0x280 + node], [8], f"TPDO2 of node {node}")
        equal([len(one.data) for one in frames if one.id == 0x180 + SENSOR], [8], "TPDO1 of the sensor")
        equal([len(one.data) for one in frames if one.id == 0x280 + SENSOR], [7], "TPDO2 of the sensor")


@test
def factory_mapping_is_layout_a(limb):
    limb.fresh()
    expected = {
        0x1600: [0x60400010, 0x60600008, 0x60710010], 0x1601: [0x607A0020, 0x60FF0020],
        0x1602: [], 0x1603: [],
        0x1A00: [0x60410010, 0x60610008, 0x60770010], 0x1A01: [0x60640020, 0x606C0020],
        0x1A02: [], 0x1A03: [0x603F0010, 0x20310108, 0x20500110]}
    valid = {0x1400: 0x200, 0x1401: 0x300, 0x1402: None, 0x1403: None, 0x1800: 0x180, 0x1801: 0x280, 0x1802: None, 0x1803: 0x480}
    for node in JOINTS:
        sdo = limb.sdo(node)
        for mapping, entries in expected.items():
            equal([sdo.u32(mapping, sub + 1) for sub in range(sdo.u8(mapping))], entries, f"{mapping:04X}h of node {node}")
        for record, base in valid.items():
            cob_id = sdo.u32(record, 1)
            equal(bool(cob_id & pdo.INVALID), base is None, f"{record:04X}h:1 of node {node} is invalid")
            if base is not None:
                equal(cob_id & 0x7FF, base + node, f"{record:04X}h:1 of node {node}")
    sensor = limb.sdo(SENSOR)
    equal([sensor.u32(0x1A00, sub) for sub in range(1, 5)], [0x71300110, 0x71300210, 0x71300310, 0x20500110], "1A00h")
    equal([sensor.u32(0x1A01, sub) for sub in range(1, 5)], [0x71300410, 0x71300510, 0x71300610, 0x61500108], "1A01h")


@test
def every_nth_sync(limb):
    only(limb, TPDO1, 3)
    limb.bus.drain()
    seen = []
    for _ in range(9):
        limb.sync()
        seen.append(count(limb, 0x180 + A, 0.04))
    equal(sum(seen), 3, "TPDOs of type 3 in nine SYNCs")
    first = seen.index(1)
    equal([at for at, one in enumerate(seen) if one], [first, first + 3, first + 6], "SYNCs that were answered")


@test
def hand_answers_every_sync(limb):
    limb.fresh(HAND)
    limb.start(HAND)
    limb.bus.drain()
    seen = 0
    for _ in range(8):
        limb.sync()
        seen += count(limb, 0x180 + HAND, 0.03)
    equal(seen, 8, "TPDO1 of the hand in eight SYNCs")


@test
def type_0_with_sync_after_a_change(limb):
    sdo = limb.fresh(A)
    pdo.quiet(sdo)
    pdo.remap(sdo, TPDO1, [STATUSWORD], 0)
    limb.start(A)
    for _ in range(3):  # the first may report the value
        limb.sync()
        count(limb, 0x180 + A, 0.03)
    for _ in range(3):
        limb.sync()
    equal(count(limb, 0x180 + A), 0, "TPDOs of type 0 without a change")
    sdo.put("<H", 0x6040, 0, 0x0006)
    equal(count(limb, 0x180 + A), 0, "TPDOs of type 0 before SYNC")
    limb.sync()
    frames = limb.frames(0.1, 0x180 + A)
    equal([pdo.u16(one.data) & 0x6F for one in frames], [0x21], "statusword in the TPDO after the change")
    limb.sync()
    equal(count(limb, 0x180 + A), 0, "TPDOs with the next SYNC")


def remote(limb, length=5):
    limb.bus.send(0x180 + A, rtr=True, dlc=length)


@test
def types_252_and_253_answer_remote_frames(limb):
    for kind in (252, 253):
        only(limb, TPDO1, kind, cob_id=0x180 + A)
        limb.bus.drain()
        limb.sync()
        equal(count(limb, 0x180 + A), 0, f"TPDOs of type {kind} with SYNC alone")
        remote(limb)
        equal(len(limb.bus.expect(0x180 + A, what=f"(type {kind}, RTR)").data), 5, "length")
        equal(count(limb, 0x180 + A), 0, "further answers")


@test
def remote_frames_where_they_are_not_allowed(limb):
    only(limb, TPDO1, 253, cob_id=0x180 + A | pdo.NO_RTR)
    limb.bus.drain()
    remote(limb)
    equal(count(limb, 0x180 + A), 0, "answers with bit 30 set")


@test
def event_timer(limb):
    for kind in (254, 255):
        only(limb, TPDO1, kind, event=50)
        limb.bus.drain()
        frames = limb.collect(1.0, 0x180 + A)
        within(len(frames), 19, 21, f"TPDOs of type {kind} in a second at 50 ms")
        gaps = [(after[0] - before[0]) * 1000 for before, after in zip(frames, frames[1:])]
        within(sum(gaps) / len(gaps), 49, 51, "mean gap in ms")


@test
def event_of_the_profile_and_inhibit_time(limb):
    sdo = limb.fresh(A)
    pdo.quiet(sdo)
    sdo.put("<H", TPDO1, 3, 2000)  # 200 ms
    pdo.remap(sdo, TPDO1, [STATUSWORD], 255)
    sdo.put("<H", TPDO1, 5, 0)
    limb.start(A)
    limb.frames(0.5)
    limb.bus.passed.clear()
    told = []
    for word in (6, 0, 6, 0, 6, 0, 6, 0, 6, 0, 6):  # changes faster than they may be sent
        limb.bus.send(0x600 + A, bytes.fromhex("2B406000") + bytes([word, 0, 0, 0]))
        told += limb.collect(0.045, 0x180 + A)
    told += limb.collect(0.6, 0x180 + A)
    that(len(told) > 2, f"{len(told)} TPDOs")
    gaps = [round((after[0] - before[0]) * 1000) for before, after in zip(told, told[1:])]
    that(all(gap >= 195 for gap in gaps), f"gaps of {gaps} ms with an inhibit time of 200 ms")
    equal(pdo.u16(told[-1][1].data) & 0x6F, 0x21, "the last state told")


@test
def inhibit_time_only_while_invalid(limb):
    sdo = limb.fresh(A)
    sdo.refused(WRONG_STATE, sdo.put, "<H", TPDO1, 3, 100)
    pdo.disable(sdo, TPDO1)
    sdo.put("<H", TPDO1, 3, 100)
    equal(sdo.u16(TPDO1, 3), 100, "1800h:3")


@test
def mapping_at_run_time(limb):
    sdo = limb.fresh(A)
    pdo.remap(sdo, TPDO1, [LINK_VOLTAGE, MODE_SHOWN, STATUSWORD], 1)
    limb.start(A)
    limb.bus.drain()
    limb.sync()
    data = limb.bus.expect(0x180 + A).data
    expected = struct.pack("<IBH", sdo.u32(0x6079), sdo.u8(0x6061), sdo.u16(0x6041))
    equal(data, expected, "TPDO of 6079h, 6061h, 6041h")


@test
def mapping_in_the_wrong_state(limb):
    sdo = limb.fresh(A)
    sdo.refused(WRONG_STATE, sdo.put, "<B", 0x1A00, 0, 0)
    sdo.refused(WRONG_STATE, sdo.put, "<I", 0x1A00, 1, STATUSWORD)
    pdo.disable(sdo, TPDO1)
    sdo.refused(WRONG_STATE, sdo.put, "<I", 0x1A00, 1, STATUSWORD)
    sdo.put("<B", 0x1A00, 0, 0)
    sdo.put("<I", 0x1A00, 1, STATUSWORD)


@test
def mapping_of_what_cannot_be_mapped(limb):
    sdo = limb.fresh(A)
    for record in (TPDO1, RPDO1):
        mapping = record + 0x200
        pdo.disable(sdo, record)
        sdo.put("<B", mapping, 0, 0)
        sdo.refused(0x06040041, sdo.put, "<I", mapping, 1, pdo.entry(0x1017, 0, 16))
        sdo.refused((0x06040041, 0x06020000), sdo.put, "<I", mapping, 1, pdo.entry(0x5FFF, 0, 16))
        sdo.refused((0x06040041, 0x06090011), sdo.put, "<I", mapping, 1, pdo.entry(0x6041, 7, 16))
        sdo.refused((0x06040041, 0x06040042, 0x06070010), sdo.put, "<I", mapping, 1, pdo.entry(0x6040, 0, 32))
    sdo.refused(0x06040041, sdo.put, "<I", 0x1600, 1, STATUSWORD)  # read only, so not allowed in an RPDO


@test
def mapping_longer_than_a_frame(limb):
    sdo = limb.fresh(A)
    pdo.disable(sdo, TPDO1)
    sdo.put("<B", 0x1A00, 0, 0)
    sdo.put("<I", 0x1A00, 1, LINK_VOLTAGE)
    sdo.put("<I", 0x1A00, 2, pdo.entry(0x6064, 0, 32))
    try:
        sdo.put("<I", 0x1A00, 3, STATUSWORD)
    except AssertionError:
        pass
    sdo.refused((0x06040042, 0x06020000), sdo.put, "<B", 0x1A00, 0, 3)
    sdo.refused((0x06090031, 0x06090030, 0x06040042), sdo.put, "<B", 0x1A00, 0, 65)
    sdo.put("<B", 0x1A00, 0, 2)


@test
def cob_ids_that_are_not_free(limb):
    sdo = limb.fresh(A)
    for record in (TPDO1, RPDO1):
        pdo.disable(sdo, record)
        for bad in (0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x701, 0x77F, 0x780, 0x7E4):
            sdo.refused(0x06090030, sdo.put, "<I", record, 1, bad | pdo.NO_RTR)
        sdo.put("<I", record, 1, 0x3A0 | pdo.NO_RTR)
        sdo.refused((0x06090030, *WRONG_STATE), sdo.put, "<I", record, 1, 0x3A1 | pdo.NO_RTR)  # valid: must not be changed


@test
def tpdo_under_another_cob_id(limb):
    only(limb, TPDO1, 1, cob_id=0x3A0 | pdo.NO_RTR)
    limb.bus.drain()
    limb.sync()
    frames = limb.frames(0.1, 0x3A0, 0x180 + A)
    equal([one.id for one in frames], [0x3A0], "frames after SYNC")


@test
def event_driven_rpdo_takes_effect_at_once(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    limb.bus.send(0x200 + A, bytes.fromhex("0600080000"))
    limb.wait(0.05)
    equal(sdo.u16(0x6040), 0x0006, "controlword")
    equal(sdo.u16(0x6041) & 0x6F, 0x21, "statusword: ready to switch on")
    equal(sdo.i8(0x6060), 8, "mode")


@test
def synchronous_rpdo_waits_for_sync(limb):
    sdo = limb.fresh(A)
    pdo.disable(sdo, RPDO1)
    sdo.put("<B", RPDO1, 2, 1)
    pdo.enable(sdo, RPDO1)
    limb.start(A)
    limb.sync()
    limb.bus.send(0x200 + A, bytes.fromhex("0600080000"))
    limb.wait(0.1)
    equal((sdo.u16(0x6040), sdo.u16(0x6041) & 0x4F), (0, 0x40), "controlword and state before SYNC")
    limb.sync()
    limb.wait(0.05)
    equal((sdo.u16(0x6040), sdo.u16(0x6041) & 0x6F), (6, 0x21), "controlword and state after SYNC")


@test
def newest_synchronous_rpdo_counts(limb):
    sdo = limb.fresh(A)
    pdo.disable(sdo, RPDO1)
    sdo.put("<B", RPDO1, 2, 1)
    pdo.enable(sdo, RPDO1)
    limb.start(A)
    for mode in (1, 3, 8):
        limb.bus.send(0x200 + A, bytes([0, 0, mode, 0, 0]))
    limb.sync()
    limb.wait(0.05)
    equal(sdo.i8(0x6060), 8, "mode")


@test
def invalid_rpdo_is_ignored(limb):
    sdo = limb.fresh(A)
    pdo.disable(sdo, RPDO1)
    limb.start(A)
    limb.bus.send(0x200 + A, bytes.fromhex("0600080000"))
    limb.wait(0.05)
    equal(sdo.u16(0x6040), 0, "controlword")


@test
def dummy_entries(limb):
    sdo = limb.fresh(A)
    pdo.remap(sdo, RPDO1, [pdo.entry(0x0007, 0, 32), pdo.entry(0x0005, 0, 8), pdo.entry(0x6060, 0, 8)], 255)
    limb.start(A)
    limb.bus.send(0x200 + A, bytes.fromhex("FFFFFFFFFF08"))
    limb.wait(0.05)
    equal(sdo.i8(0x6060), 8, "mode after five dummy bytes")


@test
def rpdo_deadline(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", RPDO1, 5, 60)
    limb.start(A)
    equal(len(limb.frames(0.2, 0x080 + A)), 0, "EMCY before the first RPDO")
    limb.bus.send(0x200 + A, bytes.fromhex("0000080000"))
    sent = limb.mark()
    limb.bus.expect(0x080 + A, where=emergency(0x8250), what="(EMCY 8250h)")
    within((limb.now - sent) * 1000, 54, 71, "ms from the RPDO to EMCY 8250h (60 configured)")


@test(seconds=60)
def all_nodes_at_200_hz(limb):
    """Two seconds of SYNC at 5 ms: every TPDO arrives exactly once per SYNC, and the frames in the order of
    identifiers."""
    limb.fresh()
    limb.nmt(START)
    limb.wait(0.1)
    limb.bus.drain()
    expected = sorted(base + node for node in JOINTS + (SENSOR, HAND) for base in (0x180, 0x280))
    for cycle in range(400):
        frames = []
        limb.sync()
        while sum(one in expected for one in frames) < len(expected):
            frame = limb.bus.receive(3.0)
            that(frame is not None, f"SYNC {cycle}: {len(frames)} of {len(expected)} TPDOs")
            that(not 0x80 < frame.id < 0x100, f"EMCY {frame.id:03X}#{frame.data.hex()}")
            if frame.id & 0x780 in (0x180, 0x280):
                frames.append(frame.id)
        equal(frames, expected, f"TPDOs of SYNC {cycle}")
        tick = limb.bus.ticks
        while limb.bus.ticks == tick:
            that(limb.bus.receive(3.0), "time stands still")
