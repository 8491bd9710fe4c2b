"""The emulated MultiSense, as far as needed by these tests."""
import socket
import struct

ADDRESS = "127.0.0.1"  # the emulator's default


def answers():
    """Returns whether it reports its status within 50 ms."""
    request = struct.pack("<HHHHHIIHH", 0xADAD, 0x0100, 1, 0, 1, 4, 0, 0x0003, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0.05)
        client.connect((ADDRESS, 9001))
        client.send(request)
        try:
            return len(client.recv(9000)) > 0
        except OSError:
            return False
