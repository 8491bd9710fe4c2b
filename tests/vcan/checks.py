"""Tests as functions, and their runner: readable lines, a time-out for each, an exit code."""
import signal
import time
import traceback

REGISTERED = []


def test(function=None, *, seconds=20, attempts=1):
    """Marks a test. It is called with the limb under test; any exception is a failure.

    A test that measures times has several attempts: a busy host can make a good time bad, but never a wrong one right."""
    def register(marked):
        REGISTERED.append((marked.__name__, marked, seconds, attempts))
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


def attempt(function, under_test, seconds, alive):
    """Runs one test and returns its note. Raises what the test raised, or TimeoutError."""
    try:
        alive()
        signal.setitimer(signal.ITIMER_REAL, seconds)
        note = function(under_test)
        signal.setitimer(signal.ITIMER_REAL, 0)
        alive()
        return note
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def place_of(error):
    at = traceback.extract_tb(error.__traceback__)
    return next((f"{one.filename.rsplit('/', 1)[-1]}:{one.lineno}" for one in reversed(at)
                 if one.filename.rsplit("/", 1)[-1].startswith("area_")), "")


def run(area, under_test, alive=lambda: None):
    """Runs all registered tests; returns how many failed. `alive` raises if the program under test has ended."""
    def out_of_time(_number, _frame):
        raise TimeoutError("out of time")

    signal.signal(signal.SIGALRM, out_of_time)
    failures = 0
    for name, function, seconds, attempts in REGISTERED:
        title = f"{area}: {name.replace('_', ' ')}"
        for left in range(attempts - 1, -1, -1):
            started = time.monotonic()
            try:
                note = attempt(function, under_test, seconds, alive)
            except Exception as error:
                kind = "" if isinstance(error, AssertionError) else f"{type(error).__name__}: "
                text = f"{place_of(error)} {kind}{error}"
                if left:
                    print(f"# {title}, once more after {text}", flush=True)
                    continue
                failures += 1
                print(f"not ok - {title}\n    {text}", flush=True)
            else:
                print(f"ok - {title} ({time.monotonic() - started:.2f} s){': ' + note if note else ''}", flush=True)
            break
    print(f"{area}: {len(REGISTERED) - failures} of {len(REGISTERED)} passed", flush=True)
    return failures
