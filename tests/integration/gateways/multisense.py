"""A client of the MultiSense's UDP protocol, written independently of the driver's."""

import socket
import struct
import time

PORT = 9001
HEAD = struct.Struct("<HHHHHII")
ACK, VERSION, STATUS, METADATA, IMAGE, DISPARITY = 0x0001, 0x0102, 0x0103, 0x010F, 0x0110, 0x0111
GET_VERSION, GET_STATUS, STREAM = 0x0002, 0x0003, 0x001C
LUMA_LEFT, LUMA_RIGHT, DISPARITY_LEFT, IMU = 1 << 4, 1 << 5, 1 << 10, 1 << 25
IMU_DATA = 0x0114


def loopback(number):
    """Returns an address of this machine, a different one for each number."""
    return f"127.{1 + number // 62500 % 250}.{1 + number // 250 % 250}.{1 + number % 250}"


class Client:
    def __init__(self, address):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16 << 20)
        self.socket.connect((address, PORT))
        self.sequence = 0
        self.parts = {}
        self.first_part = {}  # bytes of a message in its first datagram, by message id

    def close(self):
        self.socket.close()

    def send(self, message_id, version=1, body=b""):
        message = struct.pack("<HH", message_id, version) + body
        self.sequence += 1
        self.socket.send(HEAD.pack(0xADAD, 0x0100, 1, 0, self.sequence, len(message), 0) + message)

    def stream(self, modify, control):
        self.send(STREAM, 2, struct.pack("<IIII", modify, control, 0, 0))

    def message(self, seconds=10.0):
        """Returns the next message's id and body, or None if none arrives in time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                datagram = self.socket.recv(9001)
            except (TimeoutError, ConnectionRefusedError):
                time.sleep(0.01)
                continue
            magic, version, group, _, sequence, length, offset = HEAD.unpack_from(datagram)
            assert (magic, version, group) == (0xADAD, 0x0100, 1)
            payload = datagram[HEAD.size:]
            if offset == 0:
                self.parts[sequence] = bytearray()
                self.first_part[struct.unpack_from("<H", payload)[0]] = len(payload)
            if len(self.parts.get(sequence, b"")) != offset:
                self.parts.pop(sequence, None)
                continue
            self.parts[sequence] += payload
            if len(self.parts[sequence]) == length:
                whole = bytes(self.parts.pop(sequence))
                return struct.unpack_from("<H", whole)[0], whole[4:]
        return None

    def wait_for(self, wanted, seconds=10.0):
        """Returns the body of the next message with this id."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            message = self.message(left)
            if message and message[0] == wanted:
                return message[1]
        raise AssertionError(f"no message 0x{wanted:04X} in {seconds} s")


def disparities(body):
    """Returns frame, width, height and the image in 1/16 px of message 0x0111."""
    frame, width, height = struct.unpack_from("<qHH", body)
    packed = body[12:]
    image = [0] * (width * height)
    for pair in range(width * height // 2):
        a, b, c = packed[3 * pair:3 * pair + 3]
        image[2 * pair], image[2 * pair + 1] = a | (b & 15) << 8, b >> 4 | c << 4
    return frame, width, height, image


def image(body):
    """Returns source, bits per pixel, frame, width, height and pixels of message 0x0110."""
    source, bits, frame, width, height = struct.unpack_from("<IIqHH", body)
    pixels = body[20:20 + width * height * bits // 8]
    exposure, gain, high = struct.unpack_from("<IfI", body, 20 + len(pixels))
    assert exposure > 0 and gain > 0 and high == 0 and len(body) == 32 + len(pixels)
    return source, bits, frame, width, height, pixels


def histogram(metadata):
    """Returns the histogram of message 0x010F: four channels of 256."""
    return struct.unpack_from("<1024I", metadata, 8 + 4 + 4 + 4 + 8 + 4)


def imu_samples(body):
    """Returns number and samples (kind, ns, x, y, z) of message 0x0114."""
    number, version, count = struct.unpack_from("<IHI", body)
    assert version == 1 and len(body) == 10 + 22 * count
    return number, [struct.unpack_from("<Hqfff", body, 10 + 22 * i) for i in range(count)]
