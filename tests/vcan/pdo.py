"""Configures PDOs by SDO, in the order required by CiA 301 7.5.2.38."""
import struct

INVALID, NO_RTR = 1 << 31, 1 << 30


def entry(index, sub, bits):
    return index << 16 | sub << 8 | bits


def disable(sdo, record):
    sdo.put("<I", record, 1, sdo.u32(record, 1) | INVALID)


def enable(sdo, record):
    sdo.put("<I", record, 1, sdo.u32(record, 1) & ~INVALID & 0xFFFFFFFF)


def remap(sdo, record, entries, kind=None):
    """Gives the PDO with communication record `record` (14xxh, 18xxh) a new mapping and leaves it valid."""
    mapping = record + 0x200
    disable(sdo, record)
    sdo.put("<B", mapping, 0, 0)
    for sub, one in enumerate(entries, start=1):
        sdo.put("<I", mapping, sub, one)
    sdo.put("<B", mapping, 0, len(entries))
    if kind is not None:
        sdo.put("<B", record, 2, kind)
    enable(sdo, record)


def quiet(sdo):
    """Makes every TPDO of this node invalid."""
    for record in (0x1800, 0x1801, 0x1802, 0x1803):
        disable(sdo, record)


def u16(data, at=0):
    return struct.unpack_from("<H", data, at)[0]


def i16(data, at=0):
    return struct.unpack_from("<h", data, at)[0]


def i32(data, at=0):
    return struct.unpack_from("<i", data, at)[0]
