"""An SDO client (CiA 301 7.2.4) that packs every request by hand."""
import struct

ABORTS = {
    0x05030000: "toggle bit not alternated", 0x05040000: "time-out", 0x05040001: "command specifier",
    0x05040002: "block size", 0x05040003: "sequence number", 0x05040004: "CRC", 0x06010000: "access",
    0x06010001: "read of write-only", 0x06010002: "write of read-only", 0x06020000: "no object",
    0x06040041: "not mappable", 0x06040042: "PDO length", 0x06070010: "length mismatch", 0x06070012: "too long",
    0x06070013: "too short", 0x06090011: "no sub-index", 0x06090030: "value", 0x06090031: "value too high",
    0x06090032: "value too low", 0x08000020: "store", 0x08000022: "device state",
}


class Abort(AssertionError):
    def __init__(self, code, index, sub):
        super().__init__(f"abort {code >> 16:04X} {code & 0xFFFF:04X} ({ABORTS.get(code, '?')}) for {index:04X}h:{sub}")
        self.code, self.index, self.sub = code, index, sub


def crc16(data):
    """CRC-16, polynomial 1021h, start 0 (the XMODEM CRC)."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


assert crc16(b"123456789") == 0x31C3  # the published check value


class Sdo:
    """The first SDO channel of one node."""

    def __init__(self, bus, node, timeout=3.0):
        self.bus, self.node, self.timeout = bus, node, timeout

    # -- the bare frames

    def send(self, request):
        assert len(request) == 8
        self.bus.send(0x600 + self.node, request)

    def answer(self):
        frame = self.bus.expect(0x580 + self.node, self.timeout, what=f"(SDO answer of node {self.node})")
        assert len(frame.data) == 8, f"SDO answer of {len(frame.data)} bytes"
        return frame.data

    def ask(self, request):
        self.send(request)
        return self.answer()

    def initiate(self, command, index, sub, tail=b"\0\0\0\0"):
        """Sends a request with a multiplexer; raises if an abort is received, and fails if the answer has another
        multiplexer."""
        multiplexer = struct.pack("<HB", index, sub)
        return self.checked(self.ask(bytes([command]) + multiplexer + tail.ljust(4, b"\0")), index, sub)

    @staticmethod
    def checked(answer, index, sub):
        if answer[0] == 0x80:
            raise Abort(struct.unpack_from("<I", answer, 4)[0], index, sub)
        assert answer[1:4] == struct.pack("<HB", index, sub), f"answer {answer.hex()} is about another object"
        return answer

    def next_checked(self, request, index, sub):
        answer = self.ask(request)
        if answer[0] == 0x80:
            raise Abort(struct.unpack_from("<I", answer, 4)[0], index, sub)
        return answer

    def abort(self, index, sub, code=0x08000000):
        self.send(struct.pack("<BHBI", 0x80, index, sub, code))

    # -- expedited and segmented

    def upload(self, index, sub=0):
        answer = self.initiate(0x40, index, sub)
        if answer[0] & 0x02:
            assert answer[0] & 0xF0 == 0x40, f"upload answered by {answer.hex()}"
            size = 4 - (answer[0] >> 2 & 3) if answer[0] & 1 else 4
            return answer[4:4 + size]
        assert answer[0] in (0x40, 0x41), f"upload answered by {answer.hex()}"
        size = struct.unpack_from("<I", answer, 4)[0] if answer[0] & 1 else None
        data, toggle = b"", 0
        while True:
            segment = self.next_checked(bytes([0x60 | toggle]) + bytes(7), index, sub)
            assert segment[0] & 0xF0 == toggle, f"segment {segment.hex()} after toggle {toggle:02X}"
            data += segment[1:8 - (segment[0] >> 1 & 7)]
            if segment[0] & 1:
                break
            toggle ^= 0x10
        assert size is None or len(data) == size, f"{len(data)} bytes came, {size} were announced"
        return data

    def download(self, index, sub, data):
        """Expedited up to four bytes, otherwise segmented."""
        data = bytes(data)
        if 0 < len(data) <= 4:
            answer = self.initiate(0x23 | 4 - len(data) << 2, index, sub, data)
            assert answer[0] == 0x60, f"download answered by {answer.hex()}"
            return
        self.download_segments(index, sub, data)

    def download_segments(self, index, sub, data):
        answer = self.initiate(0x21, index, sub, struct.pack("<I", len(data)))
        assert answer[0] == 0x60, f"download answered by {answer.hex()}"
        toggle = 0
        for at in range(0, max(len(data), 1), 7):
            part = data[at:at + 7]
            last = at + 7 >= len(data)
            segment = bytes([toggle | 7 - len(part) << 1 | last]) + part.ljust(7, b"\0")
            answer = self.next_checked(segment, index, sub)
            assert answer[0] == 0x20 | toggle, f"segment answered by {answer.hex()}"
            toggle ^= 0x10

    def u8(self, index, sub=0):
        return self.number("<B", index, sub)

    def u16(self, index, sub=0):
        return self.number("<H", index, sub)

    def u32(self, index, sub=0):
        return self.number("<I", index, sub)

    def i8(self, index, sub=0):
        return self.number("<b", index, sub)

    def i16(self, index, sub=0):
        return self.number("<h", index, sub)

    def i32(self, index, sub=0):
        return self.number("<i", index, sub)

    def number(self, layout, index, sub):
        data = self.upload(index, sub)
        assert len(data) == struct.calcsize(layout), f"{index:04X}h:{sub} has {len(data)} bytes: {data.hex()}"
        return struct.unpack(layout, data)[0]

    def put(self, layout, index, sub, value):
        """Writes a number: put("<H", 0x1017, 0, 100)."""
        self.download(index, sub, struct.pack(layout, value))

    def refused(self, code, action, *arguments):
        """The action must be aborted with one of these codes."""
        codes = (code,) if isinstance(code, int) else code
        try:
            got = action(*arguments)
        except Abort as abort:
            names = " or ".join(f"{one >> 16:04X} {one & 0xFFFF:04X}" for one in codes)
            assert abort.code in codes, f"expected abort {names}, got {abort}"
            return abort.code
        raise AssertionError(f"expected abort {codes[0] >> 16:04X} {codes[0] & 0xFFFF:04X}, "
                             f"but {action.__name__}{arguments} was done: {got!r}")
