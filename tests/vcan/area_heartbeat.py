"""Heartbeat producer and consumer, node and life guarding (CiA 301 7.2.8.3, facts of 1016h, 1017h, 100Ch, 100Dh, 1029h)."""
import time

from checks import equal, test, that, within
from limb import JOINTS, NODES, RESET_COMMUNICATION, START, emergency, equal_state

A = JOINTS[0]
MASTER = 127


@test
def producer_keeps_its_period(limb):
    sdo = limb.fresh(A)
    for period in (20, 100):
        sdo.put("<H", 0x1017, 0, period)
        limb.bus.expect(0x700 + A, what="(first heartbeat)")
        beats = limb.collect(period / 1000 * 20.5, 0x700 + A)
        gaps = [(second[0] - first[0]) * 1000 for first, second in zip(beats, beats[1:])]
        within(len(beats), 19, 22, f"heartbeats in 20 periods of {period} ms")
        within(sum(gaps) / len(gaps), period - 0.5, period + 0.5, "mean period in ms")
        that(all(frame.data == b"\x7F" for _, frame in beats), "a heartbeat tells another state than pre-operational")
    sdo.put("<H", 0x1017, 0, 0)
    limb.mark()
    limb.bus.drain()
    equal(len(limb.frames(0.3, 0x700 + A)), 0, "heartbeats after 1017h := 0")


@test(attempts=5)
def emulated_time_is_the_host_s(limb):
    """The only test here that a busy host can make fail."""
    limb.fresh(A)
    began, first = limb.mark(), time.monotonic()
    limb.wait(1.0)
    within((time.monotonic() - first) / (limb.now - began), 0.97, 1.05, "seconds of the host in an emulated second")


@test
def all_nodes_produce_at_once(limb):
    limb.fresh()
    for node in NODES[:-3] + NODES[-2:]:
        limb.sdo(node).put("<H", 0x1017, 0, 50)
    limb.nmt(START)
    limb.wait(0.1)
    frames = limb.frames(0.5)
    for node in NODES[:-3] + NODES[-2:]:
        beats = [frame.data for frame in frames if frame.id == 0x700 + node]
        within(len(beats), 8, 12, f"heartbeats of node {node} in 0.5 s")
        equal(set(beats), {b"\5"}, f"state told by node {node}")


@test
def guarding_toggles_and_starts_at_zero(limb):
    limb.fresh(A)
    def guard():
        limb.bus.send(0x700 + A, dlc=1, rtr=True)
        return limb.bus.expect(0x700 + A, what="(guarding)").data
    equal([guard() for _ in range(4)], [b"\x7F", b"\xFF", b"\x7F", b"\xFF"], "answers")
    limb.nmt(START, A)
    equal([guard() for _ in range(3)], [b"\x05", b"\x85", b"\x05"], "answers when operational")
    limb.nmt(RESET_COMMUNICATION, A)
    limb.await_boot([A])
    equal([guard() for _ in range(2)], [b"\x7F", b"\xFF"], "answers after reset communication")


@test
def no_guarding_beside_a_heartbeat(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", 0x1017, 0, 1000)
    limb.bus.expect(0x700 + A, 1.5, what="(heartbeat)")
    limb.bus.drain()
    for _ in range(5):
        limb.bus.send(0x700 + A, dlc=1, rtr=True)
    equal(len(limb.frames(0.3, 0x700 + A)), 0, "answers to guarding while 1017h is set")


@test
def life_guarding_lost(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", 0x100C, 0, 50)
    sdo.put("<B", 0x100D, 0, 3)
    limb.start(A)  # queries it by guarding, which starts life guarding
    for _ in range(5):
        limb.bus.send(0x700 + A, dlc=1, rtr=True)
        limb.bus.expect(0x700 + A, what="(guarding)")
        last = limb.now
        limb.wait(0.05)
    limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h, life guarding)")
    within((limb.now - last) * 1000, 144, 161, "ms from the last guarding to EMCY 8130h (150 configured)")


def beat(limb, milliseconds=100):
    """Sends a few heartbeats of the master; returns the emulated time of the last one."""
    for _ in range(4):
        limb.wait(milliseconds / 2000)
        limb.bus.send(0x700 + MASTER, b"\5")
    return limb.mark()


def watch(limb, sdo, milliseconds=100):
    """Lets node A monitor the master, which has sent a few heartbeats; returns the emulated time of the last one."""
    sdo.put("<I", 0x1016, 1, MASTER << 16 | milliseconds)
    return beat(limb, milliseconds)


@test
def consumer_waits_for_the_first_heartbeat(limb):
    sdo = limb.fresh(A)
    sdo.put("<I", 0x1016, 1, MASTER << 16 | 50)
    equal(len(limb.frames(0.4, 0x080 + A)), 0, "EMCY before the first heartbeat")


@test
def consumer_times_out(limb):
    sdo = limb.fresh(A)
    last = watch(limb, sdo)
    lost = limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h)")
    within((limb.now - last) * 1000, 94, 111, "ms from the last heartbeat to EMCY 8130h (100 configured)")
    that(lost.data[2] & 0x11 == 0x11, f"error register {lost.data[2]:02X}: expected generic and communication")


@test
def behaviour_after_loss_follows_1029h(limb):
    for behaviour, state in ((0, 0x7F), (1, 0x05), (2, 0x04)):
        sdo = limb.fresh(A)
        sdo.put("<B", 0x1029, 1, behaviour)
        limb.start(A)
        watch(limb, sdo, 60)
        limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h)")
        limb.wait(0.02)
        equal_state(limb, A, state)


@test
def consumer_recovers_with_the_heartbeat(limb):
    sdo = limb.fresh(A)
    watch(limb, sdo)
    limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h)")
    limb.bus.send(0x700 + MASTER, b"\5")
    limb.bus.expect(0x080 + A, where=emergency(0x0000), what="(EMCY 0000h: the master is back)")
    equal(sdo.u8(0x1001), 0, "1001h")
    beat(limb)
    limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h of the second loss)")


@test
def a_new_master_that_sets_1016h_again(limb):
    sdo = limb.fresh(A)
    watch(limb, sdo)
    limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h)")
    watch(limb, sdo)
    equal(sdo.u8(0x1001), 0, "1001h while the new master beats")
    limb.bus.expect(0x080 + A, where=emergency(0x8130), what="(EMCY 8130h of the second loss)")


@test
def one_node_is_watched_once(limb):
    sdo = limb.fresh(A)
    entries = sdo.u8(0x1016)
    that(entries >= 1, "1016h has no entry")
    if entries < 2:
        return "1016h has one entry"
    sdo.put("<I", 0x1016, 1, MASTER << 16 | 100)
    sdo.refused((0x06040043, 0x06090030), sdo.put, "<I", 0x1016, 2, MASTER << 16 | 200)
    return None
