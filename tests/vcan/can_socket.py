"""A CAN interface through the kernel's raw socket only: frames are packed here byte by byte."""
import collections
import select
import socket
import struct
import time

RTR, EFF, ERR = 0x40000000, 0x80000000, 0x20000000
MTU, FD_MTU = 16, 72
BRS = 1
SO_TIMESTAMPNS, SO_RCVBUFFORCE, SO_RXQ_OVFL = 35, 33, 40
CAN_RAW_ERR_FILTER = 2

#: time in s (the kernel's stamp), id without flags, data, remote frame, error frame, FD frame
Frame = collections.namedtuple("Frame", "time id data rtr error fd")


class NoFrame(AssertionError):
    """The expected frame did not arrive."""


def show(frame):
    kind = "R" if frame.rtr else frame.data.hex().upper()
    return f"{frame.id:03X}{'##' if frame.fd else '#'}{kind}"


class Bus:
    """One socket on one interface. Frames received while waiting for others are kept in `passed`."""

    def __init__(self, interface, fd=False, errors=False, receive_buffer=4 << 20, filters=None):
        self.interface = interface
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, receive_buffer)
        if fd:
            self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        if errors:
            self.socket.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, 0x1FFFFFFF)
        if filters is not None:
            packed = b"".join(struct.pack("=II", can_id, mask) for can_id, mask in filters)
            self.socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed)
        self.socket.bind((interface,))
        self.passed = []
        self.ruler = None  # identifier of the heartbeats that measure emulated time
        self.ticks = 0

    def close(self):
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def send(self, can_id, data=b"", rtr=False, error=False, dlc=None):
        flags = (RTR if rtr else 0) | (ERR if error else 0)
        data = bytes(data)
        length = len(data) if dlc is None else dlc
        self.socket.send(struct.pack("=IB3x8s", can_id | flags, length, data))

    def send_fd(self, can_id, data, flags=BRS):
        self.socket.send(struct.pack("=IBB2x64s", can_id, len(data), flags, bytes(data)))

    def receive(self, timeout=1.0):
        """Returns the next frame, or None."""
        if not select.select([self.socket], [], [], max(timeout, 0))[0]:
            return None
        packet, ancillary, _, _ = self.socket.recvmsg(FD_MTU, 128)
        stamp = time.time()
        for level, kind, value in ancillary:
            if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS:
                seconds, nanoseconds = struct.unpack("=qq", value[:16])
                stamp = seconds + nanoseconds * 1e-9
        word, length = struct.unpack_from("=IB", packet)
        can_id = word & (0x1FFFFFFF if word & EFF or word & ERR else 0x7FF)
        data = b"" if word & RTR else packet[8:8 + length]
        if can_id == self.ruler:
            self.ticks += 1
        return Frame(stamp, can_id, data, bool(word & RTR), bool(word & ERR), len(packet) == FD_MTU)

    def expect(self, can_id, timeout=3.0, where=None, what=""):
        """Returns the next frame with this identifier (or one of these) that `where` accepts."""
        wanted = {can_id} if isinstance(can_id, int) else set(can_id)
        ends = time.monotonic() + timeout
        while (left := ends - time.monotonic()) > 0:
            frame = self.receive(left)
            if frame is None:
                break
            if frame.id in wanted and not frame.error and (where is None or where(frame)):
                return frame
            if frame.id != self.ruler:
                self.passed.append(frame)
        names = ", ".join(f"{one:03X}" for one in sorted(wanted))
        last = " ".join(show(one) for one in self.passed[-6:])
        raise NoFrame(f"no {names} {what} within {timeout:g} s (last other frames: {last or 'none'})")

    def drain(self):
        """Discards everything received so far."""
        while self.receive(0) is not None:
            pass
        self.passed.clear()
