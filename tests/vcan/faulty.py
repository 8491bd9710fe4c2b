"""Faults that a test injects into a running emulator, and takes back."""
import contextlib
import subprocess

from checks import equal
from limb import Limb

SOCKET = "/run/faults.sock"


def fault(program, *words):
    """Runs `walkman-hil fault`, which must succeed."""
    done = subprocess.run([program, "fault", words[0], "--socket", SOCKET, *words[1:]], capture_output=True, text=True,
                          timeout=20, check=False)
    equal(done.returncode, 0, f"fault {' '.join(words)}: {done.stderr}")
    return done.stdout


@contextlib.contextmanager
def injected(limb, *words):
    """The fault acts inside of it: injected(limb, "RElbj", "encoder-stuck", "side=0")."""
    fault(limb.program, "inject", *words)
    try:
        yield
    finally:
        fault(limb.program, "clear", "all")


def with_limb(function):
    """The test gets an emulator of its own, which must end well."""
    def run(under_test):
        limb = Limb(*under_test, options=("--realtime", "--timing", "none", "--fault-socket", SOCKET))
        try:
            note = function(limb)
            limb.emulator.alive()
        finally:
            status = limb.stop()
        equal(status, 0, "exit status of the emulator at SIGINT")
        return note
    run.__name__ = function.__name__
    return run
