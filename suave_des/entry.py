"""The command's entry point: from its first line on, Ctrl-C and kill end it without a traceback.

While the command's modules are imported nothing has begun, so it ends at once. Later `suave_des.cli.main` sees to it.
"""

import os
import signal
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def _end(number: int, frame: FrameType | None) -> None:
    os.write(2, b"suave-des: interrupted\n")
    os._exit(128 + number)


def main() -> None:
    """Run the command `suave-des`."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)
    from suave_des.cli.main import main as run

    run()
