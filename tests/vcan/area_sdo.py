"""SDO: expedited and segmented transfer, abort codes (CiA 301 7.2.4)."""
import struct

from checks import equal, test, that
from limb import HAND, JOINTS, NODES, SENSOR
from sdo import Abort

A, B = JOINTS[0], JOINTS[3]
NOTE = (0x2060, 0)  # a user text of up to 1024 bytes


@test
def expedited_upload_to_the_byte(limb):
    limb.fresh()
    for node in NODES:
        expected = "43001000 94010200" if node == SENSOR else "43001000 92010200"
        equal(limb.sdo(node).ask(bytes.fromhex("40001000 00000000")), bytes.fromhex(expected), f"answer of node {node}")


@test
def expedited_upload_of_each_size(limb):
    sdo = limb.fresh(A)
    equal(sdo.ask(bytes.fromhex("4001100000000000")), bytes.fromhex("4F01100000000000"), "1001h, one byte")
    equal(sdo.ask(bytes.fromhex("4000101000000000")), bytes.fromhex("8000101011000906"), "1000h:16")
    answer = sdo.ask(bytes.fromhex("4017100000000000"))
    equal((answer[:4], answer[6:]), (bytes.fromhex("4B171000"), b"\0\0"), "1017h, two bytes")
    equal(sdo.ask(bytes.fromhex("4018100000000000"))[:5], bytes.fromhex("4F18100004"), "1018h:0")


@test
def expedited_download_to_the_byte(limb):
    sdo = limb.fresh(A)
    equal(sdo.ask(bytes.fromhex("2B171000 D0070000")), bytes.fromhex("60171000 00000000"), "1017h := 2000")
    equal(sdo.ask(bytes.fromhex("40171000 00000000")), bytes.fromhex("4B171000 D0070000"), "1017h")
    equal(sdo.ask(bytes.fromhex("22171000 E8030000"))[:4], bytes.fromhex("60171000"), "size not given")
    equal(sdo.u16(0x1017), 1000, "1017h")
    equal(sdo.ask(bytes.fromhex("2F291001 01000000")), bytes.fromhex("60291001 00000000"), "1029h:1 := 1")
    equal(sdo.u8(0x1029, 1), 1, "1029h:1")


@test
def identities_are_distinct(limb):
    limb.fresh()
    identities = [tuple(limb.sdo(node).u32(0x1018, sub) for sub in (1, 2, 3, 4)) for node in NODES]
    equal(len({one[3] for one in identities}), len(NODES), "distinct serial numbers")


@test
def communication_objects_are_there(limb):
    limb.fresh()
    for node in NODES:
        sdo = limb.sdo(node)
        for index in (0x1000, 0x1001, 0x1003, 0x1005, 0x1006, 0x1007, 0x1008, 0x1009, 0x100A, 0x100C, 0x100D, 0x1010,
                      0x1011, 0x1012, 0x1014, 0x1015, 0x1016, 0x1017, 0x1018, 0x1019, 0x1029, 0x1200, 0x1800, 0x1801,
                      0x1802, 0x1803, 0x1A00, 0x1A01, 0x1A02, 0x1A03, 0x1F80):
            sdo.upload(index, 0)
        equal((sdo.u32(0x1200, 1), sdo.u32(0x1200, 2)), (0x600 + node, 0x580 + node), f"1200h of node {node}")
        equal(sdo.u32(0x1014), 0x080 + node, f"1014h of node {node}")
        equal(sdo.u32(0x1005) & 0x7FF, 0x080, f"1005h of node {node}")
    for node in JOINTS + (HAND,):
        for index in (0x1400, 0x1401, 0x1402, 0x1403, 0x1600, 0x1601, 0x1602, 0x1603):
            limb.sdo(node).upload(index, 0)


@test
def segmented_upload_of_the_name(limb):
    limb.fresh()
    for node in (A, SENSOR, HAND):
        sdo = limb.sdo(node)
        name = sdo.upload(0x1008)
        that(len(name) > 4 and name.isascii(), f"name {name!r}")
        first = sdo.ask(bytes.fromhex("4008100000000000"))
        equal(first, bytes.fromhex("41081000") + struct.pack("<I", len(name)), "start of the upload")
        toggle, at = 0, 0
        while at < len(name):
            part = name[at:at + 7]
            last = at + 7 >= len(name)
            expected = bytes([toggle | 7 - len(part) << 1 | last]) + part.ljust(7, b"\0")
            equal(sdo.ask(bytes([0x60 | toggle]) + bytes(7)), expected, "segment")
            toggle, at = toggle ^ 0x10, at + 7


@test
def segmented_download_and_back(limb):
    sdo = limb.fresh(A)
    for size in (5, 7, 8, 14, 100, 1024):
        note = bytes(32 + (7 * at + size) % 90 for at in range(size))
        sdo.download(*NOTE, note)
        equal(sdo.upload(*NOTE), note, f"text of {size} bytes")
    sdo.download_segments(0x1017, 0, b"\x10\x27")  # a number may be sent in segments too
    equal(sdo.u16(0x1017), 10000, "1017h")


@test
def segmented_download_without_size(limb):
    sdo = limb.fresh(A)
    equal(sdo.initiate(0x20, *NOTE)[0], 0x60, "start without a size")
    equal(sdo.ask(b"\x00abcdefg")[0], 0x20, "first segment")
    equal(sdo.ask(b"\x1Bhi" + bytes(5))[0], 0x30, "last segment")
    equal(sdo.upload(*NOTE), b"abcdefghi", "text")


@test
def toggle_not_alternated(limb):
    sdo = limb.fresh(A)
    sdo.initiate(0x40, 0x1008, 0)
    equal(sdo.ask(b"\x70" + bytes(7)), bytes.fromhex("80081000 00000305"), "upload segment with the wrong toggle")
    sdo.initiate(0x21, *NOTE, struct.pack("<I", 20))
    equal(sdo.ask(b"\x00abcdefg")[0], 0x20, "first segment")
    equal(sdo.ask(b"\x00abcdefg"), bytes.fromhex("80602000 00000305"), "download segment with the wrong toggle")
    equal(sdo.u32(0x1000), 0x00020192, "the server goes on")


@test
def unknown_command(limb):
    sdo = limb.fresh(A)
    equal(sdo.ask(bytes.fromhex("E000100000000000"))[4:], bytes.fromhex("01000405"), "command specifier 7")
    equal(sdo.ask(bytes.fromhex("6000000000000000"))[4:], bytes.fromhex("01000405"), "a segment without a start")
    equal(sdo.ask(bytes.fromhex("0000000000000000"))[4:], bytes.fromhex("01000405"), "a segment without a start")


@test
def no_such_object(limb):
    limb.fresh()
    for node in NODES:
        sdo = limb.sdo(node)
        equal(sdo.ask(bytes.fromhex("40FF5F0000000000")), bytes.fromhex("80FF5F0000000206"), "upload of 5FFFh")
        equal(sdo.ask(bytes.fromhex("23FF5F0000000000")), bytes.fromhex("80FF5F0000000206"), "download to 5FFFh")
        equal(sdo.ask(bytes.fromhex("4018100900000000")), bytes.fromhex("8018100911000906"), "upload of 1018h:9")
        equal(sdo.ask(bytes.fromhex("2301100500000000"))[4:], bytes.fromhex("11000906"), "download to 1001h:5")


@test
def access(limb):
    sdo = limb.fresh(A)
    for index, sub, layout in ((0x1000, 0, "<I"), (0x1001, 0, "<B"), (0x1018, 1, "<I"), (0x6041, 0, "<H"), (0x6064, 0, "<i"),
                               (0x6502, 0, "<I"), (0x1008, 0, "<I")):
        sdo.refused(0x06010002, sdo.put, layout, index, sub, 0)


@test
def length(limb):
    sdo = limb.fresh(A)
    sdo.refused((0x06070010, 0x06070012), sdo.put, "<I", 0x1017, 0, 5)
    sdo.refused((0x06070010, 0x06070013), sdo.put, "<B", 0x1017, 0, 5)
    sdo.refused((0x06070010, 0x06070012), sdo.download_segments, 0x1017, 0, bytes(9))
    sdo.refused((0x06070010, 0x06070012, 0x05040005), sdo.download_segments, *NOTE, bytes(2000))


@test
def values(limb):
    sdo = limb.fresh(A)
    sdo.refused(0x06090030, sdo.put, "<B", 0x1003, 0, 1)
    sdo.refused((0x06090030, 0x06090031), sdo.put, "<B", 0x6060, 0, 55)
    sdo.refused((0x06090030, 0x06090031), sdo.put, "<B", 0x1019, 0, 241)
    sdo.refused((0x06090030, 0x06090032), sdo.put, "<B", 0x1019, 0, 1)
    equal((sdo.u8(0x1019), sdo.u8(0x1003)), (0, 0), "1019h, 1003h:0")


@test
def an_abort_of_the_client_ends_the_transfer(limb):
    sdo = limb.fresh(A)
    sdo.initiate(0x40, 0x1008, 0)
    sdo.abort(0x1008, 0)
    equal(sdo.ask(b"\x60" + bytes(7))[4:], bytes.fromhex("01000405"), "a segment after the abort")
    equal(sdo.u32(0x1000), 0x00020192, "1000h")


@test
def a_new_start_replaces_the_old(limb):
    sdo = limb.fresh(A)
    sdo.initiate(0x21, *NOTE, struct.pack("<I", 20))
    equal(sdo.ask(b"\x00abcdefg")[0], 0x20, "first segment")
    equal(sdo.u32(0x1000), 0x00020192, "1000h in the middle of a download")
    that(len(sdo.upload(0x1008)) > 4, "name")


@test
def requests_of_other_lengths_are_ignored(limb):
    sdo = limb.fresh(A)
    limb.bus.send(0x600 + A, bytes.fromhex("40001000"))
    limb.bus.send(0x600 + A, bytes.fromhex("40001000000000"))
    limb.bus.send(0x600 + A, b"", rtr=True, dlc=8)
    equal(len(limb.frames(0.2, 0x580 + A)), 0, "answers")
    equal(sdo.u32(0x1000), 0x00020192, "1000h")


@test
def nine_transfers_at_a_time(limb):
    limb.fresh()
    names = {node: limb.sdo(node).upload(0x1008) for node in NODES}
    for node in NODES:
        limb.sdo(node).initiate(0x40, 0x1008, 0)
    got, toggles = {node: b"" for node in NODES}, {node: 0 for node in NODES}
    open_nodes = set(NODES)
    while open_nodes:
        for node in list(open_nodes):
            segment = limb.sdo(node).ask(bytes([0x60 | toggles[node]]) + bytes(7))
            that(segment[0] & 0xF0 == toggles[node], "toggle")
            got[node] += segment[1:8 - (segment[0] >> 1 & 7)]
            toggles[node] ^= 0x10
            if segment[0] & 1:
                open_nodes.discard(node)
    equal(got, names, "names read at the same time")


@test(seconds=90)
def every_object_reads_or_says_why(limb):
    """Reads the whole index range in steps that include every object this device may have; no request stays unanswered."""
    limb.fresh()
    for node in (A, SENSOR):
        sdo, found = limb.sdo(node), 0
        for index in [*range(0x1000, 0x1030), *range(0x1400, 0x1404), *range(0x1600, 0x1604), *range(0x1800, 0x1804),
                      *range(0x1A00, 0x1A04), *range(0x2000, 0x2064), *range(0x6000, 0x6200), 0x6402, 0x6502]:
            try:
                sdo.upload(index, 0)
                found += 1
            except Abort as abort:
                that(abort.code in (0x06020000, 0x06090011, 0x06010001, 0x06010000), f"{abort}")
        that(found > 30, f"node {node}: only {found} objects")
