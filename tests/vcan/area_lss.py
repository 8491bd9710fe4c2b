"""LSS: selection, inquiry, identification, node-ID, fastscan (CiA 305)."""
import struct

from checks import equal, test, that, within
from limb import JOINTS, NODES, RESET_COMMUNICATION, RESET_NODE

A, NEW = JOINTS[2], 63
MASTER, SLAVE = 0x7E5, 0x7E4


def tell(limb, command, tail=b""):
    limb.bus.send(MASTER, bytes([command]) + tail.ljust(7, b"\0"))


def ask(limb, command, tail=b"", timeout=3.0):
    tell(limb, command, tail)
    frame = limb.bus.expect(SLAVE, timeout, what=f"(LSS {command:02X})")
    equal(len(frame.data), 8, "length of an LSS answer")
    return frame.data


def silent(limb, command, tail=b"", duration=0.1):
    tell(limb, command, tail)
    equal([one.data.hex() for one in limb.frames(duration, SLAVE)], [], f"answers to LSS {command:02X}")


def waiting(limb):
    tell(limb, 0x04, b"\0")


def identity(limb, node):
    return [limb.sdo(node).u32(0x1018, sub) for sub in (1, 2, 3, 4)]


def select(limb, numbers):
    for command, number in zip((0x40, 0x41, 0x42), numbers):
        silent(limb, command, struct.pack("<I", number), 0.01)
    return ask(limb, 0x43, struct.pack("<I", numbers[3]))


@test
def selective_inquiry(limb):
    limb.fresh()
    for node in NODES:
        numbers = identity(limb, node)
        waiting(limb)
        equal(select(limb, numbers), b"\x44" + bytes(7), f"selection of node {node}")
        for command, number in zip((0x5A, 0x5B, 0x5C, 0x5D), numbers):
            equal(ask(limb, command), bytes([command]) + struct.pack("<I", number) + bytes(3), "inquiry")
        equal(ask(limb, 0x5E), bytes([0x5E, node]) + bytes(6), "inquiry of the node-ID")
    waiting(limb)
    silent(limb, 0x5E)


@test
def a_wrong_number_selects_nobody(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    for at in range(4):
        wrong = list(numbers)
        wrong[at] ^= 0x40000000
        for command, number in zip((0x40, 0x41, 0x42, 0x43), wrong):
            silent(limb, command, struct.pack("<I", number), 0.05)
        silent(limb, 0x5E, duration=0.05)


@test
def identify_remote_slaves(limb):
    limb.fresh()
    vendor, product, revision, serial = identity(limb, A)
    waiting(limb)

    def answers(revisions, serials):
        for command, number in zip((0x46, 0x47, 0x48, 0x49, 0x4A, 0x4B), (vendor, product, *revisions, *serials)):
            tell(limb, command, struct.pack("<I", number))
        return [one.data for one in limb.frames(0.2, SLAVE)]

    equal(answers((revision, revision), (serial, serial)), [b"\x4F" + bytes(7)], "answers in a range of one")
    equal(answers((0, 0xFFFFFFFF), (serial + 1 & 0xFFFFFFFF, serial)), [], "answers in an empty range")
    everybody = answers((0, 0xFFFFFFFF), (0, 0xFFFFFFFF))
    same = sum(identity(limb, node)[:2] == [vendor, product] for node in NODES)
    # The same frame sent by several nodes at the same instant is one frame on the bus.
    within(len(everybody), 1, same, "answers in the whole range")


@test
def nobody_is_unconfigured(limb):
    limb.fresh()
    waiting(limb)
    silent(limb, 0x4C)
    silent(limb, 0x51, struct.pack("<IBBB", 0, 0x80, 0, 0))


@test
def switch_global(limb):
    limb.fresh()
    tell(limb, 0x04, b"\x01")
    tell(limb, 0x13, b"\0\0")  # all nodes give the same answer
    frames = limb.frames(0.2, SLAVE)
    within(len(frames), 1, len(NODES), "answers in configuration state")
    equal({one.data[:2] for one in frames}, {b"\x13\0"}, "answers")
    waiting(limb)
    silent(limb, 0x13, b"\0\0")


@test
def wrong_node_id(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    select(limb, numbers)
    for bad in (0, 128, 200, 254):
        equal(ask(limb, 0x11, bytes([bad]))[:2], b"\x11\x01", f"node-ID {bad}")
    waiting(limb)
    silent(limb, 0x11, bytes([NEW]))
    equal(limb.sdo(A).u32(0x1000), 0x00020192, "1000h")


@test
def bit_timing(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    select(limb, numbers)
    equal(ask(limb, 0x13, b"\0\0")[:2], b"\x13\0", "1 Mbit/s")
    equal(ask(limb, 0x13, b"\x05\0")[:2], b"\x13\x01", "table 5")
    equal(ask(limb, 0x13, b"\0\x63")[:2], b"\x13\x01", "entry 99")
    waiting(limb)


@test
def node_id_takes_effect_at_reset_communication(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    select(limb, numbers)
    equal(ask(limb, 0x11, bytes([NEW])), b"\x11\0" + bytes(6), "set node-ID")
    waiting(limb)
    equal(limb.sdo(A).u32(0x1000), 0x00020192, "1000h under the old node-ID")
    limb.nmt(RESET_COMMUNICATION, A)
    limb.await_boot([NEW])
    equal(limb.sdo(NEW).u32(0x1018, 4), numbers[3], "serial number under the new node-ID")
    equal(limb.sdo(NEW).u32(0x1014), 0x080 + NEW, "1014h follows the node-ID")
    limb.sdo(A).send(bytes.fromhex("4000100000000000"))
    equal(len(limb.frames(0.2, 0x580 + A)), 0, "answers under the old node-ID")
    limb.nmt(RESET_NODE, NEW)
    limb.await_boot([A])  # not stored, so lost at power-on


@test
def stored_node_id_survives_reset_node(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    select(limb, numbers)
    ask(limb, 0x11, bytes([NEW]))
    equal(ask(limb, 0x17)[:2], b"\x17\0", "store")
    waiting(limb)
    limb.nmt(RESET_NODE, A)
    limb.await_boot([NEW])
    select(limb, numbers)
    ask(limb, 0x11, bytes([A]))
    ask(limb, 0x17)
    waiting(limb)
    limb.nmt(RESET_NODE, NEW)
    limb.await_boot([A])


def fastscan(limb):
    """Finds the identity of one unconfigured slave, bit by bit."""
    def asked(number, bit, sub, following):
        tell(limb, 0x51, struct.pack("<IBBB", number, bit, sub, following))
        answers = limb.frames(0.015, SLAVE)
        that(all(one.data[0] == 0x4F for one in answers), "an answer to fastscan that is not 4F")
        return bool(answers)

    that(asked(0, 0x80, 0, 0), "nobody unconfigured answers")
    found = []
    for sub in range(4):
        number = 0
        for bit in range(31, -1, -1):
            if not asked(number, bit, sub, sub):
                number |= 1 << bit
        that(asked(number, 0, sub, (sub + 1) % 4), f"fastscan lost the slave at number {sub}: {number:08X}")
        found.append(number)
    return found


@test(seconds=30)
def unconfigured_node_is_found_by_fastscan(limb):
    limb.fresh()
    numbers = identity(limb, A)
    waiting(limb)
    select(limb, numbers)
    equal(ask(limb, 0x11, b"\xFF")[:2], b"\x11\0", "node-ID 255")
    waiting(limb)
    limb.nmt(RESET_COMMUNICATION, A)
    limb.wait(0.2)
    limb.bus.drain()
    limb.sdo(A).send(bytes.fromhex("4000100000000000"))
    equal(len(limb.frames(0.2, 0x580 + A)), 0, "answers of an unconfigured node")
    equal(ask(limb, 0x4C), b"\x50" + bytes(7), "identify non-configured")
    equal(fastscan(limb), numbers, "identity")
    equal(ask(limb, 0x5E)[:2], b"\x5E\xFF", "node-ID in configuration state after fastscan")
    equal(ask(limb, 0x11, bytes([A]))[:2], b"\x11\0", "set node-ID")
    limb.bus.drain()
    waiting(limb)
    limb.await_boot([A])
    equal(limb.sdo(A).u32(0x1018, 4), numbers[3], "serial number")
