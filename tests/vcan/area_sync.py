"""SYNC: counter, window, start value, other identifiers, production (CiA 301 7.2.5)."""
import pdo
from checks import equal, test, that, within
from limb import JOINTS, emergency

A = JOINTS[0]
TPDO1, RPDO1 = 0x1800, 0x1400


def answered(limb, counter=None, can_id=0x180 + A):
    limb.sync(counter)
    return len(limb.frames(0.05, can_id))


@test
def counter_overflow_value(limb):
    sdo = limb.fresh(A)
    for value in (2, 10, 240, 0):
        sdo.put("<B", 0x1019, 0, value)
        equal(sdo.u8(0x1019), value, "1019h")
    sdo.put("<I", 0x1006, 0, 5000)
    sdo.refused(0x08000022, sdo.put, "<B", 0x1019, 0, 10)
    sdo.put("<I", 0x1006, 0, 0)
    sdo.put("<B", 0x1019, 0, 10)


@test
def start_value(limb):
    sdo = limb.fresh(A)
    sdo.put("<B", 0x1019, 0, 10)
    pdo.disable(sdo, TPDO1)
    sdo.put("<B", TPDO1, 2, 2)
    sdo.put("<B", TPDO1, 6, 4)
    pdo.enable(sdo, TPDO1)
    limb.start(A)
    limb.bus.drain()
    seen = [counter for counter in (1, 2, 3, 4, 5, 6, 7, 8, 9, 10) if answered(limb, counter)]
    # The SYNC whose counter equals the start value counts as the first one received (7.5.2.37); then every second one.
    that(seen == [5, 7, 9], f"type 2 from counter 4 on: expected TPDOs at 5, 7, 9, got {seen}")


@test
def start_value_only_while_invalid(limb):
    sdo = limb.fresh(A)
    sdo.refused((0x06010002, 0x08000022), sdo.put, "<B", TPDO1, 6, 4)


@test
def length_not_as_configured(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    limb.bus.drain()
    limb.bus.send(0x080, b"\x01\x02\x03")
    limb.bus.expect(0x080 + A, where=emergency(0x8240), what="(EMCY 8240h: 3 bytes)")
    sdo = limb.fresh(A)
    sdo.put("<B", 0x1019, 0, 10)
    limb.start(A)
    limb.bus.drain()
    limb.sync()
    limb.bus.expect(0x080 + A, where=emergency(0x8240), what="(EMCY 8240h: no counter)")


@test
def another_identifier(limb):
    sdo = limb.fresh(A)
    try:
        sdo.put("<I", 0x1005, 0, 0x0A0)
    except AssertionError as abort:
        return f"1005h cannot be changed: {abort}"
    limb.start(A)
    limb.bus.drain()
    equal(answered(limb), 0, "TPDO1 with 080h")
    limb.bus.send(0x0A0)
    equal(len(limb.frames(0.1, 0x180 + A)), 1, "TPDO1 with 0A0h")
    return None


@test
def remote_sync_is_no_sync(limb):
    limb.fresh(A)
    limb.start(A)
    limb.bus.drain()
    limb.bus.send(0x080, rtr=True)
    equal(len(limb.frames(0.1, 0x180 + A)), 0, "TPDO1 after a remote frame with 080h")


@test
def window_drops_late_rpdos(limb):
    sdo = limb.fresh(A)
    pdo.disable(sdo, RPDO1)
    sdo.put("<B", RPDO1, 2, 1)
    pdo.enable(sdo, RPDO1)
    sdo.put("<I", 0x1006, 0, 400000)
    sdo.put("<I", 0x1007, 0, 100000)
    limb.start(A)
    for delay, word, expected in ((0.0, 6, 6), (0.25, 7, 6), (0.03, 7, 7)):
        limb.sync()
        limb.wait(delay)
        limb.bus.send(0x200 + A, bytes([word, 0, 8, 0, 0]))
        limb.wait(0.4 - delay)
        limb.sync()
        limb.wait(0.35)
        equal(sdo.u16(0x6040), expected, f"controlword after an RPDO {delay * 1000:g} ms after SYNC (window 100 ms)")


@test
def production(limb):
    sdo = limb.fresh(A)
    sdo.put("<I", 0x1006, 0, 20000)
    try:
        sdo.put("<I", 0x1005, 0, 0x40000080)
    except AssertionError as abort:
        that("0609 0030" in str(abort), f"refused by {abort}")
        return "nodes of this kind do not produce SYNC, and say so"
    limb.start(A)
    limb.bus.drain()
    frames = limb.frames(1.0, 0x080)
    within(len(frames), 49, 51, "SYNCs in 1 s at 20 ms")
    equal({one.data for one in frames}, {b""}, "data of SYNC")
    sdo.put("<I", 0x1005, 0, 0x00000080)
    limb.mark()
    limb.bus.drain()
    equal(len(limb.frames(0.2, 0x080)), 0, "SYNCs after bit 30 was cleared")
    return None
