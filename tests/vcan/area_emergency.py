"""EMCY, error register and error history (CiA 301 7.2.7, 7.5.2.2, .4)."""
import struct

from checks import equal, test, that
from limb import JOINTS, emergency

A = JOINTS[0]


def short_rpdo(limb):
    limb.bus.send(0x200 + A, b"\0\0")


def good_rpdo(limb):
    limb.bus.send(0x200 + A, bytes.fromhex("0000080000"))


@test
def rpdo_too_short(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    limb.bus.drain()
    limb.bus.send(0x200 + A, bytes.fromhex("06000800"))
    frame = limb.bus.expect(0x080 + A, where=emergency(0x8210), what="(EMCY 8210h)")
    equal(frame.data[2], 0x11, "error register in the EMCY")
    equal(sdo.u8(0x1001), 0x11, "1001h")
    equal(sdo.u8(0x1003), 1, "1003h:0")
    equal(sdo.u32(0x1003, 1) & 0xFFFF, 0x8210, "1003h:1")
    equal(sdo.u16(0x6040), 0, "controlword: the frame was not used")


@test
def rpdo_too_long(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    limb.bus.drain()
    limb.bus.send(0x200 + A, bytes.fromhex("06000800000000"))
    limb.bus.expect(0x080 + A, where=emergency(0x8220), what="(EMCY 8220h)")
    limb.wait(0.05)
    equal(sdo.u16(0x6040), 6, "controlword: the first bytes were used")


@test
def once_an_error_and_its_end(limb):
    sdo = limb.fresh(A)
    limb.start(A)
    limb.bus.drain()
    for _ in range(5):
        short_rpdo(limb)
    limb.bus.expect(0x080 + A, where=emergency(0x8210), what="(EMCY 8210h)")
    frames = limb.frames(0.2, 0x080 + A)
    equal([one.data.hex() for one in frames], [], "further EMCY of the same error")
    good_rpdo(limb)
    gone = limb.bus.expect(0x080 + A, what="(EMCY 0000h)")
    equal(gone.data[:3], b"\0\0\0", "EMCY after the error is gone")
    equal(sdo.u8(0x1001), 0, "1001h")


@test
def history_newest_first_and_cleared(limb):
    sdo = limb.fresh(A)
    sdo.refused((0x08000024, 0x06090011), sdo.upload, 0x1003, 1)
    limb.start(A)
    short_rpdo(limb)
    limb.bus.expect(0x080 + A, where=emergency(0x8210), what="(EMCY 8210h)")
    limb.bus.send(0x200 + A, bytes.fromhex("0000080000FF"))
    limb.bus.expect(0x080 + A, where=emergency(0x8220), what="(EMCY 8220h)")
    equal(sdo.u8(0x1003), 2, "1003h:0")
    equal([sdo.u32(0x1003, sub) & 0xFFFF for sub in (1, 2)], [0x8220, 0x8210], "1003h:1, 1003h:2")
    sdo.refused(0x06090030, sdo.put, "<B", 0x1003, 0, 7)
    sdo.put("<B", 0x1003, 0, 0)
    equal(sdo.u8(0x1003), 0, "1003h:0 after clearing")
    sdo.refused((0x08000024, 0x06090011), sdo.upload, 0x1003, 1)


@test
def switched_off_by_1014h(limb):
    sdo = limb.fresh(A)
    sdo.put("<I", 0x1014, 0, 0x80000080 + A)
    limb.start(A)
    limb.bus.drain()
    short_rpdo(limb)
    equal(len(limb.frames(0.3, 0x080 + A)), 0, "EMCY while 1014h bit 31 is set")
    equal(sdo.u32(0x1003, 1) & 0xFFFF, 0x8210, "1003h:1")


@test
def inhibit_time(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", 0x1015, 0, 3000)  # 300 ms
    limb.start(A)
    limb.bus.drain()
    told = []
    for _ in range(3):
        short_rpdo(limb)
        told += limb.collect(0.01, 0x080 + A)
        good_rpdo(limb)
        told += limb.collect(0.01, 0x080 + A)
    limb.bus.send(0x200 + A, bytes.fromhex("0000080000FF"))
    told += limb.collect(1.5, 0x080 + A)
    that(len(told) >= 2, f"{len(told)} EMCY")
    gaps = [round((after[0] - before[0]) * 1000) for before, after in zip(told, told[1:])]
    that(min(gaps) >= 295, f"gaps of {gaps} ms with an inhibit time of 300 ms")


@test
def manufacturer_bytes_make_eight(limb):
    limb.fresh(A)
    limb.start(A)
    short_rpdo(limb)
    frame = limb.bus.expect(0x080 + A, where=emergency(0x8210), what="(EMCY 8210h)")
    equal(len(frame.data), 8, "length")
    equal(struct.unpack_from("<H", frame.data)[0], 0x8210, "code")
