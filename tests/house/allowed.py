"""Exceptions that tests/house/house_test accepts: {name: reason}."""

CLOCK = {
    "drivers/can/receive_batch.cpp": "SocketCAN: the kernel's time stamps are read on the host's two clocks",
    "drivers/can/socket_can.cpp": "SocketCAN: stamps a frame's arrival; pauses while an interface starts again",
    "drivers/robot/kernel_cycle.cpp": "the driver side's own pace on a real robot; in lock-step it gives up on an emulator that has gone",
    "emulator/gateways/socketcand_server.cpp": "time-outs of clients and the beacon's period are the host's: its timer",
    "adaptation/perception/stage_one.cpp": "reports how long the computation took",
}
STREAMS = {
    "apps/shared/standard_streams.cpp": "the functions themselves",
    "apps/shared/progress_line.cpp": "moves the terminal's cursor; its text is made visible first",
}
FOLDERS = {}
NAMES = {}
SIZES = {
    "apps/shared/commands.h": "the list of verbs, which main.cpp and every verb's own file read",
    "apps/shared/exit_code.h": "what every verb ends with; libraries without a command line throw its error",
    "urdf/reader/wrench.h": "a spatial force: both sides of the wire speak of it, and most of them of no model",
    "drivers/time.h": "the one type that everything shares, and that needs no frame",
}
TRUTH = "ground truth that tests judge by"
REACHED = {
    "walkman::plant::Plant::allowed_overlaps": TRUTH,
    "walkman::plant::Plant::hoist_tension": TRUTH,
    "walkman::plant::Plant::tendon_tension": TRUTH,
    "walkman::plant::Plant::drive_count": "how many drives a test of the plant alone has to advance",
    "walkman::sensors::StereoRays::hidden_tests": "shows a test how few points are tested for being hidden",
}
