"""Store and restore of parameters, and TIME (CiA 301 7.5.2.13, .14, 7.2.6)."""
import struct

from checks import equal, test, that, within
from limb import JOINTS, RESET_COMMUNICATION, RESET_NODE, SENSOR

A = JOINTS[0]
SAVE, LOAD = b"save", b"load"
CLOCK_MILLISECONDS, CLOCK_DAYS = (0x2061, 1), (0x2061, 2)  # set by TIME


def again(limb, node=A, command=RESET_NODE):
    limb.nmt(command, node)
    limb.await_boot([node])
    return limb.sdo(node)


def factory(limb, node=A):
    """Restores factory settings, whatever a test left behind."""
    limb.fresh(node).download(0x1011, 1, LOAD)
    return again(limb, node)


@test
def store_and_restore(limb):
    for node in (A, SENSOR):
        sdo = factory(limb, node)
        default = sdo.u16(0x1017)
        sdo.put("<H", 0x1017, 0, 700)
        equal(sdo.ask(bytes.fromhex("23101001") + SAVE), bytes.fromhex("60101001 00000000"), "1010h:1 := save")
        equal(again(limb, node).u16(0x1017), 700, "1017h after reset node")
        sdo.put("<H", 0x1017, 0, 800)
        equal(again(limb, node).u16(0x1017), 700, "1017h changed but not stored, after reset node")
        sdo.download(0x1011, 1, LOAD)
        equal(sdo.u16(0x1017), 700, "1017h after load, before reset")
        equal(again(limb, node).u16(0x1017), default, "1017h after load and reset node")


@test
def application_parameters_are_stored_too(limb):
    sdo = factory(limb)
    default = sdo.u32(0x6085)
    sdo.put("<I", 0x6085, 0, default + 5)
    sdo.download(0x1010, 1, SAVE)
    equal(again(limb).u32(0x6085), default + 5, "6085h after reset node")
    factory(limb)
    equal(limb.sdo(A).u32(0x6085), default, "6085h after load and reset node")


@test
def pdo_settings_are_stored(limb):
    sdo = factory(limb)
    default = sdo.u32(0x1800, 1)
    sdo.put("<I", 0x1800, 1, default | 0x80000000)
    sdo.put("<B", 0x1A00, 0, 0)
    sdo.put("<I", 0x1A00, 1, 0x60410010)
    sdo.put("<B", 0x1A00, 0, 1)
    sdo.download(0x1010, 1, SAVE)
    sdo = again(limb)
    equal((sdo.u32(0x1800, 1), sdo.u8(0x1A00), sdo.u32(0x1A00, 1)), (default | 0x80000000, 1, 0x60410010), "1800h:1, 1A00h")
    sdo = factory(limb)
    equal((sdo.u32(0x1800, 1), sdo.u8(0x1A00)), (default, 3), "1800h:1 and 1A00h:0 of the factory")


@test
def wrong_signatures(limb):
    sdo = factory(limb)
    sdo.put("<H", 0x1017, 0, 700)
    for index in (0x1010, 0x1011):
        sdo.refused((0x08000020, 0x06090030, 0x08000000), sdo.download, index, 1, b"sAve")
        sdo.refused((0x08000020, 0x06090030, 0x08000000), sdo.put, "<I", index, 1, 0)
    equal(again(limb).u16(0x1017) != 700, True, "nothing was stored")


@test
def what_can_be_stored(limb):
    sdo = factory(limb)
    for index in (0x1010, 0x1011):
        that(sdo.u8(index) >= 1, f"{index:04X}h:0")
        that(sdo.u32(index, 1) & 1, f"{index:04X}h:1 says that it does nothing")


@test
def groups_of_parameters(limb):
    sdo = factory(limb)
    if sdo.u8(0x1010) < 3:
        return "1010h has no sub-index 2 and 3"
    defaults = sdo.u16(0x1017), sdo.u32(0x6085)
    sdo.put("<H", 0x1017, 0, 700)
    sdo.put("<I", 0x6085, 0, defaults[1] + 9)
    sdo.download(0x1010, 2, SAVE)
    sdo = again(limb)
    equal((sdo.u16(0x1017), sdo.u32(0x6085)), (700, defaults[1]), "1017h, 6085h after storing communication parameters")
    sdo.put("<I", 0x6085, 0, defaults[1] + 9)
    sdo.download(0x1010, 3, SAVE)
    sdo = again(limb)
    equal((sdo.u16(0x1017), sdo.u32(0x6085)), (700, defaults[1] + 9), "1017h, 6085h after storing application parameters")
    factory(limb)
    return None


@test
def reset_communication_restores_what_was_stored(limb):
    sdo = factory(limb)
    sdo.put("<H", 0x1017, 0, 700)
    sdo.download(0x1010, 1, SAVE)
    sdo.put("<H", 0x1017, 0, 800)
    equal(again(limb, A, RESET_COMMUNICATION).u16(0x1017), 700, "1017h after reset communication")
    factory(limb)


@test
def time_sets_the_clock_of_the_node(limb):
    sdo = factory(limb)
    sdo.put("<I", 0x1012, 0, 0x80000100)
    limb.bus.drain()
    limb.bus.send(0x100, struct.pack("<IH", 43200000, 15000))  # noon, 15000 days after 1984-01-01
    limb.wait(0.5)
    within(sdo.u32(*CLOCK_MILLISECONDS), 43200450, 43201500, "milliseconds after midnight, half a second later")
    equal(sdo.u16(*CLOCK_DAYS), 15000, "days since 1984-01-01")
    limb.bus.send(0x100, struct.pack("<IH", 86399900, 15000))
    limb.wait(0.3)
    equal(sdo.u16(*CLOCK_DAYS), 15001, "days after midnight has passed")
    equal([one.data.hex() for one in limb.frames(0.1, 0x080 + A)], [], "EMCY after TIME")


@test
def time_is_ignored_when_not_consumed_or_malformed(limb):
    sdo = factory(limb)
    sdo.put("<I", 0x1012, 0, 0x80000100)
    limb.bus.send(0x100, struct.pack("<IH", 1000, 9000))
    sdo.u32(0x1000)
    limb.bus.send(0x100, b"\0\0\0\0")
    sdo.put("<I", 0x1012, 0, 0x00000100)
    limb.bus.send(0x100, struct.pack("<IH", 1000, 123))
    limb.wait(0.05)
    equal(sdo.u16(*CLOCK_DAYS), 9000, "days since 1984-01-01")
