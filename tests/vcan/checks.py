"""Tests as functions, and their running: readable lines, a time-out each, an exit code."""
import signal
import time
import traceback

REGISTERED = []


def test(function=None, *, seconds=20):
    """Marks a test. It is called with the limb under test; any exception is a failure."""
    def register(marked):
        REGISTERED.append((marked.__name__, marked, seconds))
        return marked
    return register(function) if function else register


def equal(got, expected, what):
    if got != expected:
        def text(value):
            return value.hex(" ").upper() if isinstance(value, bytes) else f"{value:#x}" if type(value) is int else repr(value)
        raise AssertionError(f"{what}: expected {text(expected)}, got {text(got)}")


def within(got, low, high, what):
    if not low <= got <= high:
        raise AssertionError(f"{what}: expected {low:g} to {high:g}, got {got:g}")


def that(condition, what):
    if not condition:
        raise AssertionError(what)


def run(area, under_test, alive=lambda: None):
    """Runs all registered tests; returns how many failed. `alive` raises when the program under test has ended."""
    def out_of_time(_number, _frame):
        raise TimeoutError("out of time")

    signal.signal(signal.SIGALRM, out_of_time)
    failures = 0
    for name, function, seconds in REGISTERED:
        started = time.monotonic()
        try:
            alive()
            signal.setitimer(signal.ITIMER_REAL, seconds)
            note = function(under_test)
            signal.setitimer(signal.ITIMER_REAL, 0)
            alive()
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:
            signal.setitimer(signal.ITIMER_REAL, 0)
            failures += 1
            at = traceback.extract_tb(error.__traceback__)
            place = next((f"{one.filename.rsplit('/', 1)[-1]}:{one.lineno}" for one in reversed(at)
                          if one.filename.rsplit("/", 1)[-1].startswith("area_")), "")
            kind = "" if isinstance(error, AssertionError) else f"{type(error).__name__}: "
            print(f"not ok - {area}: {name.replace('_', ' ')}\n    {place} {kind}{error}", flush=True)
        else:
            took = time.monotonic() - started
            print(f"ok - {area}: {name.replace('_', ' ')} ({took:.2f} s){': ' + note if note else ''}", flush=True)
    print(f"{area}: {len(REGISTERED) - failures} of {len(REGISTERED)} passed", flush=True)
    return failures
