#!/usr/bin/python3
"""Moves one joint in cyclic synchronous position mode with python-canopen, using the joint's EDS.

    walkman-hil export eds --out eds
    walkman-hil emulate --can rarm=vcan0
    examples/python_canopen/move_joint.py --channel vcan0 --eds eds/joint_drive.eds

python-canopen (https://github.com/christiansandberg/canopen) is not in Debian 12: `pip install canopen` in a virtual
environment. Exit code 0 if the joint went there and came back.
"""
import argparse
import math
import sys
import time

CYCLE = 0.005  # s; the drive's 60C2h is 5 ms


def move(network, node, distance, seconds):
    node.nmt.send_command(0x82)  # reset communication: factory PDOs
    node.nmt.wait_for_bootup(5)
    if node.sdo[0x603F].raw != 0:
        node.sdo[0x6040].raw = 0x00
        node.sdo[0x6040].raw = 0x80  # fault reset by a rising edge
    node.sdo[0x6060].raw = 8
    # A joint does not start at 0: the first target is its present position, set before operation is enabled.
    start = node.sdo[0x6064].raw
    node.sdo[0x607A].raw = start
    node.tpdo.read()
    node.rpdo.read()
    node.nmt.state = "OPERATIONAL"

    def cycle(controlword, target):
        end = time.monotonic() + CYCLE
        network.sync.transmit()
        node.rpdo[1]["Controlword"].raw = controlword
        node.rpdo[1]["Modes of operation"].raw = 8
        node.rpdo[1].transmit()
        node.rpdo[2]["Target position"].raw = target
        node.rpdo[2].transmit()
        time.sleep(max(0.0, end - time.monotonic()))

    for controlword, wanted in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        for _ in range(400):
            cycle(controlword, start)
            if node.tpdo[1]["Statusword"].raw & 0x6F == wanted:
                break
        else:
            raise RuntimeError("statusword stays at %04Xh" % node.tpdo[1]["Statusword"].raw)
    goal, cycles = int(distance * 1e6), int(seconds / CYCLE)
    for begin, end in ((0, goal), (goal, 0)):
        for i in range(1, cycles + 1):
            share = 0.5 - 0.5 * math.cos(math.pi * i / cycles)
            cycle(0x0F, start + int(begin + (end - begin) * share))
        for _ in range(100):
            cycle(0x0F, start + end)
        position = node.tpdo[2]["Position actual value"].raw
        print("at %.4f rad" % (position * 1e-6))
        if abs(position - start - end) > 2000:
            raise RuntimeError("%.4f rad off" % ((position - start - end) * 1e-6))
    cycle(0x06, start)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--eds", required=True)
    parser.add_argument("--node", type=int, default=14)
    parser.add_argument("--distance", type=float, default=0.1, help="rad")
    parser.add_argument("--seconds", type=float, default=1.0, help="for the way there, and for the way back")
    options = parser.parse_args()
    import canopen  # after the options, so that --help works without it

    network = canopen.Network()
    network.connect(interface=options.interface, channel=options.channel)
    try:
        move(network, network.add_node(options.node, options.eds), options.distance, options.seconds)
    except (RuntimeError, canopen.SdoError, canopen.nmt.NmtError) as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        network.disconnect()
    return 0


if __name__ == "__main__":
    sys.exit(main())
