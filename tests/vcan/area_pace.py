"""A master and an emulator that disagree on what advances time: the master detects it from the nodes' heartbeats. And
how an emulator reports that it is ready, on the kernel's bus."""
import os
import subprocess

import camera
from can_socket import Bus
from checks import equal, test, that
from limb import Process
from robot import CAN

OWN_PROCESSES = True


def refused(under_test, emulator_options, master_options):
    program, scene = under_test
    emulator = Process([program, "emulate", "--scene", scene, "--can", CAN, "--camera", camera.ADDRESS, *emulator_options],
                       "emulate")
    try:
        while not camera.answers():
            emulator.alive()
        master = subprocess.run([program, "grasp", "--can", CAN, "--camera", camera.ADDRESS, *master_options],
                                capture_output=True, text=True, timeout=240, check=False)
    finally:
        status = emulator.stop()
    equal(status, 0, "exit status of the emulator")
    equal(master.returncode, 3, f"exit status of the master, which said {master.stderr[-300:]!r} and {master.stdout[-300:]!r}")
    lines = [line for line in master.stderr.splitlines() if line.startswith("walkman-hil: ")]
    equal(len(lines), 1, "sentences")
    return lines[0]


@test(seconds=300)
def lockstep_with_another_period(under_test):
    line = refused(under_test, ["--lockstep", "--period", "10"], ["--lockstep"])
    that("heartbeats that are due every 100 ms arrive every 50 ms" in line and "--lockstep --period 5" in line, line)
    return line


@test(seconds=300)
def lockstep_with_another_rate(under_test):
    line = refused(under_test, ["--lockstep"], ["--lockstep", "--rate", "100"])
    that("heartbeats that are due every 100 ms arrive every 200 ms" in line and "--lockstep --period 10" in line, line)
    return line


@test(seconds=120)
def ready_when_the_nodes_have_booted(under_test):
    program, scene = under_test
    with Bus("vcan1", filters=[(0x700, 0x780)]) as arm:
        reader, writer = os.pipe()
        emulator = subprocess.Popen([program, "emulate", "--scene", scene, "--can", "rarm=vcan1", "--camera", camera.ADDRESS,
                                     "--ready-fd", str(writer)], pass_fds=(writer,), stderr=subprocess.PIPE, text=True,
                                    stdout=subprocess.DEVNULL)
        os.close(writer)
        try:
            with os.fdopen(reader) as pipe:
                equal(pipe.read(), "ready\n", "what the descriptor told before it was closed")
            booted = set()
            while (frame := arm.receive(0)) is not None:  # all of them have arrived by now
                if frame.data == b"\0":
                    booted.add(frame.id - 0x700)
        finally:
            emulator.terminate()
            errors = emulator.communicate(timeout=60)[1]
    that(len(booted) >= 8, f"nodes that booted on the arm's bus: {sorted(booted)}")
    that("nodes have booted" in errors, f"what stderr told: {errors!r}")
    return f"{len(booted)} on this bus"


@test(seconds=300)
def lockstep_with_an_emulator_in_real_time(under_test):
    line = refused(under_test, ["--realtime"], ["--lockstep"])
    that("without a SYNC" in line and "--lockstep --period 5" in line, line)
    return line


@test(seconds=300)
def real_time_with_an_emulator_in_lockstep_and_another_period(under_test):
    line = refused(under_test, ["--lockstep", "--period", "10"], ["--realtime"])
    that("heartbeats that are due every 100 ms arrive every" in line and "without --lockstep" in line, line)
    return line
