"""Heartbeat producer and consumer, node and life guarding (CiA 301 7.2.8.3, facts of 1016h, 1017h, 100Ch, 100Dh, 1029h)."""
import time

from checks import equal, test, that, within
from limb import JOINTS, NODES, RESET_COMMUNICATION, START, emergency, equal_state

A = JOINTS[0]
MASTER = 127


@test(attempts=3)
def producer_keeps_its_period(limb):
    sdo = limb.fresh(A)
    for period in (20, 100):
        sdo.put("<H", 0x1017, 0, period)
        limb.bus.expect(0x700 + A, period / 1000 + 0.1, what="(first heartbeat)")
        beats = limb.bus.collect(period / 1000 * 20.5, 0x700 + A)
        gaps = [(second.time - first.time) * 1000 for first, second in zip(beats, beats[1:])]
        within(len(beats), 19, 21, f"heartbeats in 20 periods of {period} ms")
        within(sum(gaps) / len(gaps), period * 0.95, period * 1.05, "mean period in ms")
        that(all(beat.data == b"\x7F" for beat in beats), "a heartbeat tells another state than pre-operational")
    sdo.put("<H", 0x1017, 0, 0)
    limb.bus.drain()
    equal(len(limb.bus.collect(0.3, 0x700 + A)), 0, "heartbeats after 1017h := 0")


@test(attempts=3)
def all_nodes_produce_at_once(limb):
    limb.fresh()
    for node in NODES:
        limb.sdo(node).put("<H", 0x1017, 0, 50)
    limb.nmt(START)
    time.sleep(0.1)
    limb.bus.drain()
    frames = limb.bus.collect(0.5)
    for node in NODES:
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
    equal(len(limb.bus.collect(0.3, 0x700 + A)), 0, "answers to guarding while 1017h is set")


@test(attempts=3)
def life_guarding_lost(limb):
    sdo = limb.fresh(A)
    sdo.put("<H", 0x100C, 0, 50)
    sdo.put("<B", 0x100D, 0, 3)
    limb.start(A)  # asks by guarding, which begins the life guarding
    for _ in range(5):
        limb.bus.send(0x700 + A, dlc=1, rtr=True)
        last = limb.bus.expect(0x700 + A, what="(guarding)")
        time.sleep(0.05)
    lost = limb.bus.expect(0x080 + A, 1.0, emergency(0x8130), "(EMCY 8130h, life guarding)")
    within((lost.time - last.time) * 1000, 140, 180, "ms from the last guarding to EMCY 8130h (150 configured)")


def watch(limb, sdo, milliseconds=100):
    """Node A watches the master; a few heartbeats; the time of the last."""
    sdo.put("<I", 0x1016, 1, MASTER << 16 | milliseconds)
    for _ in range(4):
        limb.bus.send(0x700 + MASTER, b"\5")
        last = time.time()
        time.sleep(milliseconds / 2000)
    return last


@test
def consumer_waits_for_the_first_heartbeat(limb):
    sdo = limb.fresh(A)
    sdo.put("<I", 0x1016, 1, MASTER << 16 | 50)
    equal(len(limb.bus.collect(0.4, 0x080 + A)), 0, "EMCY before the first heartbeat")


@test(attempts=3)
def consumer_times_out(limb):
    sdo = limb.fresh(A)
    last = watch(limb, sdo)
    lost = limb.bus.expect(0x080 + A, 1.0, emergency(0x8130), "(EMCY 8130h)")
    within((lost.time - last) * 1000, 95, 125, "ms from the last heartbeat to EMCY 8130h (100 configured)")
    that(lost.data[2] & 0x11 == 0x11, f"error register {lost.data[2]:02X}: expected generic and communication")


@test
def behaviour_after_loss_follows_1029h(limb):
    for behaviour, state in ((0, 0x7F), (1, 0x05), (2, 0x04)):
        sdo = limb.fresh(A)
        sdo.put("<B", 0x1029, 1, behaviour)
        limb.start(A)
        watch(limb, sdo, 60)
        limb.bus.expect(0x080 + A, 1.0, emergency(0x8130), "(EMCY 8130h)")
        time.sleep(0.02)
        equal_state(limb, A, state)


@test
def consumer_recovers_with_the_heartbeat(limb):
    sdo = limb.fresh(A)
    watch(limb, sdo)
    limb.bus.expect(0x080 + A, 1.0, emergency(0x8130), "(EMCY 8130h)")
    watch(limb, sdo)
    limb.bus.expect(0x080 + A, 1.0, emergency(0x8130), "(EMCY 8130h of the second loss)")


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
