"""The wrist's force/torque sensor (CiA 404)."""
import struct

import pdo
from checks import equal, test, that, within
from limb import SENSOR

CHANNELS = (1, 2, 3, 4, 5, 6)
TARA = b"tara"


def real(sdo, channel):
    """Returns 6130h of a channel, N or N·m."""
    return struct.unpack("<f", sdo.upload(0x6130, channel))[0]


@test
def values_in_every_form(limb):
    sdo = limb.fresh(SENSOR)
    equal(sdo.u32(0x1000), 0x00020194, "1000h")
    digits = [sdo.u8(0x6132, channel) for channel in CHANNELS]
    equal(digits, [1, 1, 1, 2, 2, 2], "6132h")
    for channel in CHANNELS:
        unit = 0.1 if channel <= 3 else 0.01
        noise = 0.6 if channel <= 3 else 0.02
        # The arm moves while one value after the other is read, and unevenly in the host's time: how far each integer
        # lies outside the reals before and after it, averaged over many.
        differences = []
        before = real(sdo, channel)
        for _ in range(20):
            short = sdo.i16(0x7130, channel) * unit
            after = real(sdo, channel)
            differences.append(short - min(max(short, min(before, after)), max(before, after)))
            before = after
        mean = sum(differences) / len(differences)
        within(mean, -noise, noise, f"7130h:{channel} scaled beside 6130h:{channel}, mean")
    equal(sdo.u32(0x6131, 1), 0x00210000, "6131h:1, newton")


@test
def tpdos_pair_up(limb):
    sdo = limb.fresh(SENSOR)
    limb.start(SENSOR)
    limb.wait(1.0)  # the arm hangs still: the values compared are not from the same instant
    limb.bus.drain()
    counters = []
    for _ in range(10):
        limb.sync()
        first = limb.bus.expect(0x180 + SENSOR, what="(TPDO1)").data
        second = limb.bus.expect(0x280 + SENSOR, what="(TPDO2)").data
        equal((len(first), len(second)), (8, 7), "lengths")
        counters.append(pdo.u16(first, 6))
        limb.wait(0.01)
    steps = [after - before & 0xFFFF for before, after in zip(counters, counters[1:])]
    that(all(0 < step < 200 for step in steps), f"the sample counter steps by {steps}")
    for channel, at in ((1, 0), (2, 2), (3, 4)):
        within(pdo.i16(first, at) - sdo.i16(0x7130, channel), -30, 30, f"TPDO1 minus 7130h:{channel}, 0.1 N")
    equal(second[6], 0, "status in TPDO2")


@test
def tare_of_a_channel(limb):
    sdo = limb.fresh(SENSOR)
    limb.wait(1.0)  # the arm hangs still
    channel = 3
    sdo.download(0x6139, channel, TARA)
    limb.wait(0.1)
    nets = [struct.unpack("<f", sdo.upload(0x6140, channel))[0] for _ in range(20)]
    within(sum(nets) / len(nets), -1.5, 1.5, "net force after tare, N")
    sdo.refused((0x06090030, 0x08000020, 0x08000000), sdo.download, 0x6139, channel, b"TARA")


@test
def operating_mode_off(limb):
    sdo = limb.fresh(SENSOR)
    equal([sdo.u8(0x6112, channel) for channel in CHANNELS], [1] * 6, "6112h")


@test
def status_bits(limb):
    sdo = limb.fresh(SENSOR)
    limb.wait(0.2)  # there is no reading before the first sample after a reset
    equal(sdo.u8(0x6150, 1) & 7, 0, "6150h:1")


@test
def filter_can_be_set(limb):
    sdo = limb.fresh(SENSOR)
    kinds = [sdo.u8(0x61A0, channel) for channel in CHANNELS]
    constants = [sdo.upload(0x61A1, channel) for channel in CHANNELS]
    sdo.download(0x61A1, 1, constants[0])
    return f"61A0h {kinds}, 61A1h:1 {constants[0].hex()}"
