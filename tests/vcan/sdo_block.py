"""SDO block transfer (CiA 301 7.2.4.3.9 to .16), the client side, with losses on demand."""
import struct

from sdo import Abort, crc16


def block_upload(sdo, index, sub=0, block_size=127, lose=(), crc=True):
    """Reads an object. `lose`: numbers of segments (counted from 1 over the whole transfer, as they arrive) that are
    treated as lost. Returns the data and how often the server sent each block."""
    lose = set(lose)
    answer = sdo.initiate(0xA4 if crc else 0xA0, index, sub, bytes([block_size, 0]))
    assert answer[0] & ~0x04 == 0xC2, f"block upload answered by {answer.hex()}"
    with_crc = bool(answer[0] & 0x04)
    size = struct.unpack_from("<I", answer, 4)[0]
    data, arrived, blocks = b"", 0, 0
    sdo.send(b"\xA3" + bytes(7))
    while True:
        good, last_seen, parts, finished = 0, 0, [], False
        while True:
            segment = sdo.answer()
            if segment[0] == 0x80:
                raise Abort(struct.unpack_from("<I", segment, 4)[0], index, sub)
            arrived += 1
            number = segment[0] & 0x7F
            assert number == last_seen + 1, f"segment {number} after {last_seen}"
            last_seen = number
            if arrived not in lose and number == good + 1:
                good = number
                parts.append(segment[1:])
                finished = bool(segment[0] & 0x80)
            if segment[0] & 0x80 or number == block_size:
                break
        blocks += 1
        data += b"".join(parts)
        sdo.send(bytes([0xA2, good, block_size]) + bytes(5))
        if finished:
            break
    end = sdo.answer()
    assert end[0] & 0xE3 == 0xC1, f"end of block upload: {end.hex()}"
    unused = end[0] >> 2 & 7
    data = data[:len(data) - unused]
    told = struct.unpack_from("<H", end, 1)[0]
    if crc and with_crc:
        assert told == crc16(data), f"CRC {told:04X} for data whose CRC is {crc16(data):04X}"
    sdo.send(b"\xA1" + bytes(7))
    assert len(data) == size, f"{len(data)} bytes came, {size} were announced"
    return data, blocks, with_crc


def block_download(sdo, index, sub, data, lose=(), spoil_crc=False, announce=None):
    """Writes an object. `lose`: numbers of segments (counted over the whole transfer, as sent) that are not put
    on the bus. Returns how many blocks it took."""
    lose = set(lose)
    size = len(data) if announce is None else announce
    answer = sdo.initiate(0xC6, index, sub, struct.pack("<I", size))
    assert answer[0] & ~0x04 == 0xA0, f"block download answered by {answer.hex()}"
    block_size = answer[4]
    assert 1 <= block_size <= 127, f"block size {block_size}"
    parts = [data[at:at + 7] for at in range(0, len(data), 7)]
    at, sent, blocks = 0, 0, 0
    while at < len(parts):
        block = parts[at:at + block_size]
        for number, part in enumerate(block, start=1):
            sent += 1
            last = 0x80 if at + number == len(parts) else 0
            if sent not in lose:
                sdo.send(bytes([last | number]) + part.ljust(7, b"\0"))
        blocks += 1
        answer = sdo.answer()
        if answer[0] == 0x80:
            raise Abort(struct.unpack_from("<I", answer, 4)[0], index, sub)
        assert answer[0] == 0xA2, f"block answered by {answer.hex()}"
        assert answer[1] <= len(block), f"segment {answer[1]} confirmed of {len(block)}"
        at += answer[1]
        block_size = answer[2]
        assert 1 <= block_size <= 127, f"block size {block_size}"
    crc = crc16(data) ^ (0xFFFF if spoil_crc else 0)
    unused = 7 - len(parts[-1])
    end = sdo.next_checked(bytes([0xC1 | unused << 2]) + struct.pack("<H", crc) + bytes(5), index, sub)
    assert end[0] == 0xA1, f"end of block download answered by {end.hex()}"
    return blocks
