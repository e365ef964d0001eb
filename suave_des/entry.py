"""The command's entry point: from its first line on, Ctrl-C and kill end it without a traceback.

While the command's modules are imported nothing has begun, so it ends at once. Later
`suave_des.cli.main` sees to it.
"""

import signal

from suave_des.interrupts import end_interrupted, not_ignored


def main() -> None:
    """Run the command `suave-des`."""
    for number in not_ignored():
        signal.signal(number, end_interrupted)
    from suave_des.imports import leave_current_folder

    leave_current_folder()
    from suave_des.cli.main import main as run

    run()
