"""SDO block transfer with CRC, losses and its aborts (CiA 301 7.2.4.3.9 to .16)."""
import struct

from checks import equal, test, that
from limb import HAND, JOINTS, SENSOR
from sdo_block import block_download, block_upload

A = JOINTS[0]
NOTE = (0x2060, 0)
EDS = (0x1021, 0)


def text(size, seed=0):
    return bytes(32 + (11 * at + 5 * (at // 7) + seed) % 90 for at in range(size))


@test
def upload_of_the_name(limb):
    limb.fresh()
    for node in (A, SENSOR, HAND):
        sdo = limb.sdo(node)
        data, _, with_crc = block_upload(sdo, 0x1008)
        equal(data, sdo.upload(0x1008), "name by block and by segments")
        that(with_crc, "the server does not offer a CRC")


@test
def upload_without_crc(limb):
    sdo = limb.fresh(A)
    equal(block_upload(sdo, 0x1008, crc=False)[0], sdo.upload(0x1008), "name")


@test(seconds=60)
def upload_of_the_stored_eds(limb):
    sdo = limb.fresh(A)
    data, blocks, _ = block_upload(sdo, *EDS)
    that(data.lstrip().startswith(b"["), f"1021h begins with {data[:20]!r}")
    that(b"DeviceInfo" in data, "1021h has no DeviceInfo")
    return f"{len(data)} bytes in {blocks} blocks"


@test(seconds=60)
def download_and_back(limb):
    sdo = limb.fresh(A)
    for size in (1, 6, 7, 8, 889, 890, 1024):
        block_download(sdo, *NOTE, text(size))
        equal(block_upload(sdo, *NOTE)[0], text(size), f"{size} bytes by blocks")
        equal(sdo.upload(*NOTE), text(size), f"{size} bytes by segments")


@test(seconds=60)
def upload_with_block_sizes(limb):
    sdo = limb.fresh(A)
    block_download(sdo, *NOTE, text(300))
    for block_size in (1, 2, 7, 42, 43, 44, 126, 127):
        data, blocks, _ = block_upload(sdo, *NOTE, block_size=block_size)
        equal(data, text(300), f"text with blocks of {block_size}")
        equal(blocks, -(-43 // block_size), f"blocks of {block_size}")


@test(seconds=60)
def upload_with_lost_segments(limb):
    sdo = limb.fresh(A)
    block_download(sdo, *NOTE, text(1000))
    for lose in ({1}, {5}, {5, 6, 7}, {143}, {1, 143}, {20, 60, 100}):
        data, blocks, _ = block_upload(sdo, *NOTE, block_size=50, lose=lose)
        equal(data, text(1000), f"text with segments {lose} lost")
        that(blocks > 3, "no block was sent again")


@test(seconds=60)
def download_with_lost_segments(limb):
    sdo = limb.fresh(A)
    for seed, lose in enumerate(({1}, {3}, {3, 4}, {10, 50})):
        block_download(sdo, *NOTE, text(800, seed), lose=lose)
        equal(sdo.upload(*NOTE), text(800, seed), f"text with segments {lose} lost")


@test
def download_with_a_wrong_crc(limb):
    sdo = limb.fresh(A)
    sdo.download(*NOTE, b"before")
    sdo.refused(0x05040004, lambda: block_download(sdo, *NOTE, text(50), spoil_crc=True))
    equal(sdo.upload(*NOTE), b"before", "text after a download with a wrong CRC")


@test
def block_size_out_of_range(limb):
    sdo = limb.fresh(A)
    for size in (0, 128, 255):
        answer = sdo.ask(bytes([0xA4]) + struct.pack("<HBB", 0x1008, 0, size) + bytes(3))
        equal(answer, bytes.fromhex("8008100002000405"), f"upload with blocks of {size}")
    sdo.initiate(0xA4, 0x1008, 0, bytes([127, 0]))
    sdo.send(b"\xA3" + bytes(7))
    while not sdo.answer()[0] & 0x80:
        pass
    equal(sdo.ask(bytes([0xA2, 0, 0]) + bytes(5))[4:], bytes.fromhex("02000405"), "next block of 0")


@test
def sequence_number_out_of_range(limb):
    sdo = limb.fresh(A)
    sdo.initiate(0xA4, 0x1008, 0, bytes([127, 0]))
    sdo.send(b"\xA3" + bytes(7))
    while not sdo.answer()[0] & 0x80:
        pass
    answer = sdo.ask(bytes([0xA2, 100, 127]) + bytes(5))
    equal(answer[:1] + answer[4:], bytes.fromhex("8003000405"), "confirmation of a segment never sent")


@test
def aborts_at_the_start(limb):
    sdo = limb.fresh(A)
    def up(index, sub):
        return block_upload(sdo, index, sub)
    def down(index, sub, data):
        return block_download(sdo, index, sub, data)
    sdo.refused(0x06020000, up, 0x5FFF, 0)
    sdo.refused(0x06090011, up, 0x1018, 9)
    sdo.refused(0x06020000, down, 0x5FFF, 0, bytes(20))
    sdo.refused(0x06010002, down, 0x1008, 0, bytes(20))
    sdo.refused((0x06070010, 0x06070012, 0x05040005), down, *NOTE, bytes(5000))
    sdo.refused((0x06070010, 0x06070012), down, 0x1017, 0, bytes(20))
    equal(sdo.u32(0x1000), 0x00020192, "1000h")


@test
def small_objects_by_block(limb):
    sdo = limb.fresh(A)
    block_download(sdo, 0x1017, 0, b"\xB8\x0B")
    equal(sdo.u16(0x1017), 3000, "1017h")
    equal(block_upload(sdo, 0x1017)[0], b"\xB8\x0B", "1017h by block")


@test
def protocol_switch(limb):
    """pst larger than the size: the server may answer as for a plain upload (CiA 301 7.2.4.3.13)."""
    sdo = limb.fresh(A)
    answer = sdo.initiate(0xA4, 0x1017, 0, bytes([127, 100]))
    if answer[0] == 0x4B:
        return "expedited"
    equal(answer[0] & ~0x04, 0xC2, "neither a block upload nor a plain one")
    sdo.abort(0x1017, 0)
    equal(sdo.u32(0x1000), 0x00020192, "1000h")
    return "stays with blocks"


@test
def abort_in_the_middle(limb):
    sdo = limb.fresh(A)
    block_download(sdo, *NOTE, text(1000))
    sdo.initiate(0xA4, *NOTE, bytes([20, 0]))
    sdo.send(b"\xA3" + bytes(7))
    for _ in range(20):
        sdo.answer()
    sdo.abort(*NOTE)
    equal(len(limb.frames(0.2, 0x580 + A)), 0, "frames after the client's abort")
    equal(sdo.upload(*NOTE), text(1000), "text")
    sdo.initiate(0xC6, *NOTE, struct.pack("<I", 200))
    sdo.send(b"\x01abcdefg")
    sdo.abort(*NOTE)
    equal(sdo.upload(*NOTE), text(1000), "text after an aborted download")
