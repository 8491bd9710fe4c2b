"""Faults as a client sees them that shares no code with the product: each kind without it, with it, and when it is over."""
import struct
import time

import drive
from can_socket import Bus
from checks import equal, test, that, within
from drive import Cycle
from faulty import injected, with_limb
from limb import JOINTS, NODES, PREOPERATIONAL, SENSOR, START, STOP, emergency
from sdo import Abort

OWN_PROCESSES = True
ELBOW = JOINTS[3]  # RElbj
CYCLIC_POSITION = 8


def operational(limb):
    limb.fresh()
    sdo = limb.sdo(ELBOW)
    sdo.put("<I", 0x1803, 1, 0x80000480 + ELBOW)  # its TPDO4 would come between the others
    limb.nmt(START)
    limb.mark()
    limb.bus.passed.clear()


def answers(limb, *nodes, count=1, wait=0.02):
    """Returns the first two TPDOs of these nodes to `count` SYNCs, each as (time since the first SYNC, frame)."""
    began = limb.mark()
    for _ in range(count - 1):
        limb.sync()
        limb.mark()
    limb.sync()
    found = [(began, frame) for frame in limb.bus.passed] + limb.collect(wait)
    limb.bus.passed.clear()
    ids = {base + node for node in nodes for base in (0x180, 0x280)}
    return [(time - began, frame) for time, frame in found if frame.id in ids]


def from_now(limb, duration, *can_ids):
    """Returns the frames with these identifiers of `duration` seconds that begin now."""
    limb.mark()
    found = limb.collect(duration, *can_ids)
    return [frame for time, frame in found if time > limb.now - duration]


def fails(what, action, *arguments):
    """Checks that an SDO client's action fails, not by an abort, with a message that contains `what`."""
    try:
        found = action(*arguments)
    except Abort:
        raise
    except AssertionError as error:
        that(what in str(error), str(error))
    else:
        that(False, f"it succeeds: {found}")


def kinds(frames):
    return [frame.id - ELBOW for _, frame in frames]


@test(seconds=90)
@with_limb
def frames_on_their_way(limb):
    operational(limb)
    limb.sdo(ELBOW).put("<H", 0x1017, 0, 10)
    sound = answers(limb, ELBOW)
    equal(kinds(sound), [0x180, 0x280], "TPDOs of a SYNC")
    lengths = [len(frame.data) for _, frame in sound]

    def heartbeats():
        return [frame.data for frame in from_now(limb, 0.1, 0x700 + ELBOW)]

    equal(set(heartbeats()), {b"\x05"}, "heartbeats of an operational node")
    with injected(limb, "RElbj", "payload-bitflip", "share=1", "bits=1", "direction=from"):
        flipped = [data[0] ^ 5 for data in heartbeats()]
        that(flipped and all(one.bit_count() == 1 for one in flipped), f"one bit is flipped in each heartbeat, but {flipped}")
    with injected(limb, "RElbj", "wrong-length", "bytes=-1", "direction=from"):
        equal([len(frame.data) for _, frame in answers(limb, ELBOW)], [length - 1 for length in lengths], "lengths")
    limb.sdo(ELBOW).put("<H", 0x1017, 0, 0)
    with injected(limb, "RElbj", "frame-duplicate", "direction=from"):
        equal(sorted(kinds(answers(limb, ELBOW))), [0x180, 0x180, 0x280, 0x280], "TPDOs, each sent twice")
    with injected(limb, "RElbj", "frame-reorder", "direction=from"):
        equal(kinds(answers(limb, ELBOW)), [0x280, 0x180], "TPDOs, the second before the first")
    with injected(limb, "RElbj", "frame-burst-loss", "frames=3", "direction=from"):
        equal(len(answers(limb, ELBOW, count=5)), 10 - 3, "TPDOs to five SYNCs")
    with injected(limb, "RElbj", "frame-delay", "delay=0.05", "direction=from"):
        late = answers(limb, ELBOW, JOINTS[4], wait=0.1)
        times = {node: [time for time, frame in late if frame.id & 0x7F == node] for node in (ELBOW, JOINTS[4])}
        equal([len(found) for found in times.values()], [2, 2], "TPDOs")
        within(min(times[ELBOW]) - max(times[JOINTS[4]]), 0.04, 0.06, "delay after another node's TPDOs, s")
    equal(kinds(answers(limb, ELBOW)), [0x180, 0x280], "TPDOs afterwards")


@test(seconds=90)
@with_limb
def frames_of_nobody(limb):
    operational(limb)

    def seen(*can_ids):
        return from_now(limb, 0.2, *can_ids)

    equal(seen(0x001, 0x080, 0x600 + ELBOW, 0x200 + ELBOW), [], "frames that nobody sends")
    with injected(limb, "rarm", "babbling-idiot", "id=1", "rate=1000"):
        within(len(seen(0x001)), 180, 220, "babbled frames in 0.2 s")
    with injected(limb, "rarm", "rogue-master", "command=1", "rate=100"):
        within(len(seen(0x080)), 18, 22, "SYNCs in 0.2 s")
    with injected(limb, "rarm", "rogue-master", "command=3", f"node={ELBOW}", "rate=100"):
        within(len(seen(0x600 + ELBOW)), 18, 22, "SDO requests in 0.2 s")
    with injected(limb, "rarm", "rogue-master", "command=4", f"node={ELBOW}", "rate=100"):
        zeros = seen(0x200 + ELBOW)
        within(len(zeros), 18, 22, "RPDOs in 0.2 s")
        equal({frame.data.strip(b"\0") for frame in zeros}, {b""}, "their data without zeros")
    equal(limb.state(ELBOW), 0x05, "NMT state until a rogue master commands another")
    with injected(limb, "rarm", "rogue-master", "command=0"):
        equal(limb.state(ELBOW), 0x04, "NMT state at its command")
    with injected(limb, "rarm", "rogue-master", "command=2"):
        limb.await_boot(NODES)


@test(seconds=90)
@with_limb
def a_node_that_misbehaves(limb):
    operational(limb)
    limb.sdo(ELBOW).put("<H", 0x1017, 0, 10)
    heartbeat, emcy = 0x700 + ELBOW, 0x080 + ELBOW

    def beats(duration=0.2):
        return [frame.data for frame in from_now(limb, duration, heartbeat)]

    within(len(beats()), 19, 21, "heartbeats in 0.2 s")
    with injected(limb, "RElbj", "heartbeat-loss"):
        equal(beats(), [], "lost heartbeats")
        equal(kinds(answers(limb, ELBOW)), [0x180, 0x280], "TPDOs meanwhile")
    with injected(limb, "RElbj", "clock-drift", "ppm=-500000"):
        within(len(beats()), 9, 11, "heartbeats in 0.2 s by a clock of half the speed")
    equal(from_now(limb, 0.1, emcy), [], "emergencies of a sound node")
    with injected(limb, "RElbj", "emergency-storm", "code=20480", "rate=1000"):
        storm = from_now(limb, 0.1, emcy)
        within(len(storm), 90, 110, "emergencies in 0.1 s")
        that(all(emergency(0x5000)(frame) for frame in storm), "each of them is 5000h")
    limb.mark()
    with injected(limb, "RElbj", "nmt-preop-drop"):
        equal(set(beats()), {b"\x7f"}, "NMT state by its heartbeats")
    limb.nmt(START, ELBOW)
    limb.mark()
    limb.bus.passed.clear()
    with injected(limb, "RElbj", "silent-reboot"):
        limb.await_boot([ELBOW])
    operational(limb)
    with injected(limb, "RElbj", "duplicate-node"):
        limb.await_boot([ELBOW])  # of the second one


@test(seconds=60)
@with_limb
def pdos_that_are_frozen(limb):
    operational(limb)
    sdo = limb.sdo(ELBOW)
    limb.nmt(PREOPERATIONAL, ELBOW)
    limb.start(ELBOW)
    sdo.put("<H", 0x1017, 0, 10)
    sdo.put("<B", 0x1803, 2, 1)
    sdo.put("<I", 0x1803, 1, 0x480 + ELBOW)

    def counters():
        found = []
        for _ in range(4):
            limb.sync()
            found.append(limb.bus.expect(0x480 + ELBOW, what="(TPDO4)").data[3:5])
        return len(set(found))

    equal(counters(), 4, "values of 2050h in four TPDOs")
    with injected(limb, "RElbj", "pdo-frozen"):
        equal(counters(), 1, "values of 2050h in four frozen TPDOs")
        that(limb.frames(0.1, 0x700 + ELBOW), "heartbeats go on")
    equal(counters(), 4, "values of 2050h in four TPDOs afterwards")


@test(seconds=60)
@with_limb
def sdo_servers_that_misbehave(limb):
    limb.fresh()
    sdo = limb.sdo(ELBOW, timeout=0.5)
    name, product = sdo.upload(0x1008), sdo.u32(0x1018, 2)
    equal(name, b"RElbj", "1008h")
    with injected(limb, "RElbj", "sdo-abort", f"index={0x1017}", f"code={0x08000022}"):
        sdo.refused(0x08000022, sdo.u16, 0x1017)
        equal(sdo.upload(0x1008), name, "1008h, which is not aborted")
    equal(sdo.u16(0x1017), 0, "1017h afterwards")
    with injected(limb, "RElbj", "sdo-timeout"):
        fails("no 58E", sdo.ask, bytes.fromhex("4017100000000000"))
    with injected(limb, "RElbj", "sdo-toggle-error"):
        fails("toggle", sdo.upload, 0x1008)
    sdo.abort(0x1008, 0)
    with injected(limb, "RElbj", "wrong-identity", "sub=2"):
        that(sdo.u32(0x1018, 2) != product, "1018h:2 of another device")
    equal((sdo.u32(0x1018, 2), sdo.upload(0x1008)), (product, name), "1018h:2 and 1008h afterwards")


@test(seconds=60)
@with_limb
def a_controller_that_misbehaves(limb):
    operational(limb)
    emcy = 0x080 + ELBOW
    equal(kinds(answers(limb, ELBOW)), [0x180, 0x280], "TPDOs")
    with injected(limb, "RElbj", "error-passive"):
        limb.sync()
        limb.bus.expect(emcy, where=emergency(0x8120), what="(EMCY 8120h: error-passive)")
    limb.wait(0.1)
    limb.bus.passed.clear()
    with injected(limb, "RElbj", "no-acknowledge"):
        repeated = kinds(answers(limb, ELBOW))  # once its controller is error-passive, receivers see each attempt
        that(0x280 not in repeated and (not repeated or len(repeated) > 100), f"TPDOs that nobody acknowledges: {repeated[:10]}")
    limb.wait(0.1)
    limb.bus.passed.clear()
    equal(kinds(answers(limb, ELBOW)), [0x180, 0x280], "TPDOs afterwards")
    # Runs of error frames make the others error-passive, too, and each of them says so: only the elbow's are of interest.
    with Bus("vcan1", filters=[(emcy, 0x7FF)]) as elbow:
        with injected(limb, "RElbj", "bus-off"):
            limb.sync()
            time.sleep(0.05)
        elbow.expect(emcy, where=emergency(0x8140), what="(EMCY 8140h: back from bus-off)")
    limb.bus.drain()
    limb.mark()
    equal(limb.state(ELBOW), 0x7F, "NMT state after the communication error")
    limb.start(ELBOW)
    equal(kinds(answers(limb, ELBOW)), [0x180, 0x280], "TPDOs afterwards")


@test(seconds=120)
@with_limb
def a_force_torque_sensor_that_lies(limb):
    limb.fresh(SENSOR)
    limb.start(SENSOR)
    limb.wait(2.0)  # until the arm hangs still

    def readings(count=60):
        """Returns all channels `count` times, N and N·m."""
        found = []
        for _ in range(count):
            limb.sync()
            first, second = (limb.bus.expect(base + SENSOR).data for base in (0x180, 0x280))
            found.append([0.1 * x for x in struct.unpack("<hhh", first[:6])] + [0.01 * x for x in struct.unpack("<hhh", second[:6])])
            limb.mark()
        return found

    def means(found):
        return [sum(one) / len(one) for one in zip(*found)]

    def spread(found, channel):
        mean = means(found)[channel]
        return (sum((one[channel] - mean) ** 2 for one in found) / len(found)) ** 0.5

    sound = readings()
    load = means(sound)
    most = max(range(3), key=lambda axis: abs(load[axis]))  # the axis with most of the hand's weight
    least = min(range(3), key=lambda axis: abs(load[axis]))
    that(abs(load[most]) > 4 and abs(load[most]) - abs(load[least]) > 3, f"the hand's weight: {load}")
    with injected(limb, "r_arm_ft", "ft-gain", "gain=2"):
        within(means(readings())[most] / load[most], 1.9, 2.1, "ratio of a reading at twice the gain")
    with injected(limb, "r_arm_ft", "ft-sign", f"axis={most}"):
        within(means(readings())[most] / load[most], -1.1, -0.9, "ratio of a reading whose sign is wrong")
    with injected(limb, "r_arm_ft", "ft-swap", f"axis={most}", f"other={least}"):
        swapped = means(readings())
        within(swapped[least] - load[most], -0.5, 0.5, "N, on the other axis")
        within(swapped[most] - load[least], -0.5, 0.5, "N, from the other axis")
    with injected(limb, "r_arm_ft", "ft-saturation", "force=2", "torque=0.1"):
        saturated = readings()
        that(max(abs(x) for one in saturated for x in one[:3]) <= 2.05, "forces are 2 N at most")
        that(max(abs(x) for one in saturated for x in one[3:]) <= 0.105, "torques are 0.1 N·m at most")
        within(abs(means(saturated)[most]), 1.9, 2.05, "N, where the weight is more")
    that(spread(sound, most) < 2, f"{spread(sound, most)} N of noise without a fault")
    with injected(limb, "r_arm_ft", "ft-noise", "force=20", "torque=0"):
        within(spread(readings(120), most), 14, 26, "N of noise, standard deviation")
    that(all(len({one[axis] for one in sound}) > 1 for axis in range(3)), "readings that are alive")
    with injected(limb, "r_arm_ft", "ft-stuck", "part=0"):
        stuck = readings(20)
        equal([len({one[axis] for one in stuck}) for axis in range(3)], [1, 1, 1], "different forces in 20 readings")
        that(any(len({one[axis] for one in stuck}) > 1 for axis in range(3, 6)), "torques that are alive")
    with injected(limb, "r_arm_ft", "ft-bias-drift", "force=10", "torque=0"):
        before = means(readings(20)), limb.mark()
        limb.wait(1.0)
        after = means(readings(20)), limb.mark()
        within((after[0][most] - before[0][most]) / (after[1] - before[1]), 8, 12, "N/s of drift")
    within(means(readings())[most] - load[most], -0.5, 0.5, "N, afterwards")


@test(seconds=120)
@with_limb
def encoders_and_thermistors_that_lie(limb):
    sdo = limb.fresh(ELBOW)
    limb.wait(2.0)  # until the arm hangs still
    motor, link = sdo.i32(0x6064), sdo.i32(0x60E4, 1)
    for side, offset in ((0, 0.05), (1, -0.05)):
        with injected(limb, "RElbj", "encoder-offset", f"side={side}", f"offset={offset}"):
            limb.wait(0.02)
            shifts = [sdo.i32(0x6064) - motor, sdo.i32(0x60E4, 1) - link]
            within(shifts[side], 1e6 * offset - 3000, 1e6 * offset + 3000, f"µrad, of encoder {side}")
            within(shifts[1 - side], -3000, 3000, "µrad, of the other one")
    limb.fresh(ELBOW)
    torque = sdo.i32(0x2020, 2)
    that(abs(torque) > 500, f"{torque} mN·m of the forearm's weight")
    with injected(limb, "RElbj", "torque-dropout"):
        limb.wait(0.02)
        equal((sdo.i32(0x2020, 2), sdo.i16(0x6077)), (0, 0), "torque")
    within(sdo.i16(0x2030, 1), 150, 500, "motor's temperature, 0.1 °C")
    with injected(limb, "RElbj", "temperature-high", "rise=150"):
        limb.bus.expect(0x080 + ELBOW, where=emergency(0x4310), what="(EMCY 4310h: too hot)")
        that(sdo.i16(0x2030, 1) > 1000, "motor's temperature")
        equal(drive.state(sdo.u16(0x6041)), "fault", "state")


def enabled(limb):
    limb.fresh(ELBOW)
    cycle = Cycle(limb, ELBOW, CYCLIC_POSITION)
    cycle.prepare()
    cycle.enable()
    return cycle


def moved(cycle, by, steps=60):
    """Moves the set-point by so many µrad; returns how far motor and link went."""
    sdo = cycle.limb.sdo(ELBOW)
    began = sdo.i32(0x6064), sdo.i32(0x60E4, 1)
    target = cycle.position
    for step in range(1, steps + 1):
        cycle.position = target + by * step // steps
        cycle.step()
    cycle.step(40)
    return sdo.i32(0x6064) - began[0], sdo.i32(0x60E4, 1) - began[1]


def said(cycle):
    """Returns the error codes of the elbow's emergencies so far."""
    cycle.limb.mark()
    frames = cycle.others + cycle.limb.bus.passed
    return [struct.unpack_from("<H", frame.data)[0] for frame in frames if frame.id == 0x080 + ELBOW]


@test(seconds=180)
@with_limb
def actuators_that_fail(limb):
    cycle = enabled(limb)
    sdo = limb.sdo(ELBOW)
    for by in (30000, -30000):
        motor, link = moved(cycle, by)
        within(motor - by, -2000, 2000, "µrad, motor's motion beside the set-point's")
        within(link - by, -5000, 5000, "µrad, link's motion beside the set-point's")
    with injected(limb, "RElbj", "joint-locked"):
        motor, _ = moved(cycle, 5000)
        within(motor, -500, 500, "µrad, motion of a locked motor")
    cycle = enabled(limb)
    rated = sdo.u32(0x6076) / 1000

    def torque_in_motion(by):
        """Returns the motor's mean torque in N·m, by its current, in a motion by so many µrad."""
        limb.mark()
        found, target = [], cycle.position
        for step in range(1, 101):
            cycle.position = target + by * step // 100
            cycle.step()
            if step > 50:
                found.append(sdo.i16(0x6078) / 1000 * rated)
        return sum(found) / len(found)

    free = torque_in_motion(100000)
    torque_in_motion(-100000)
    with injected(limb, "RElbj", "brake-drag", "torque=20"):
        dragging = torque_in_motion(100000)
    within(dragging - free, 14, 26, "N·m more with the brake dragging")
    cycle = enabled(limb)
    deflection = sdo.i32(0x2020, 1)
    with injected(limb, "RElbj", "compliance-change", "stiffness=0.5"):
        cycle.step(60)
        within(sdo.i32(0x2020, 1) / deflection, 1.25, 2.2, "ratio of deflections with half the stiffness and friction")
    cycle = enabled(limb)
    torque = sdo.i32(0x2020, 2)
    with injected(limb, "RForearm", "push", "y=0", "z=-60"):
        cycle.step(60)
        that(abs(sdo.i32(0x2020, 2) - torque) > 3000, f"{torque} mN·m before a push, then {sdo.i32(0x2020, 2)}")
    cycle = enabled(limb)
    for kind, parameter, code in (("overcurrent-trip", (), 0x2310), ("undervoltage", ("voltage=20",), 0x3220)):
        equal(said(cycle), [], f"emergencies before {kind}")
        with injected(limb, "RElbj", kind, *parameter):
            cycle.step(4)
            that(code in said(cycle), f"no EMCY {code:04X}h at {kind}, but {said(cycle)}")
            equal(drive.state(sdo.u16(0x6041)), "fault", f"state after {kind}")
        cycle = enabled(limb)
    held = cycle.position
    with injected(limb, "RElbj", "torque-loss", "share=0"):
        cycle.step(60)
        sagged = abs(sdo.i32(0x6064) - held)
        that(sagged > 2000, f"{sagged} µrad without the motor's torque")
    cycle = enabled(limb)
    held = cycle.position
    with injected(limb, "RElbj", "runaway", "torque=30"):
        cycle.step(40)
        ran = sdo.i32(0x6064) - held
        that(abs(ran) > 1000, f"{ran} µrad by a motor with a torque of its own")
    cycle = enabled(limb)
    for side, code in ((0, 0x7305), (1, 0x7306)):
        with injected(limb, "RElbj", "encoder-stuck", f"side={side}"):
            moved(cycle, 450000, steps=120)  # farther than the spring's torque can deflect it
            that(code in said(cycle), f"no EMCY {code:04X}h at a stuck encoder, but {said(cycle)}")
        cycle = enabled(limb)
    limb.nmt(STOP)
    return f"{free:.1f} N·m, {dragging:.1f} N·m with the brake dragging; sagged {sagged} µrad, ran {ran} µrad"
