"""The ``rig`` command: registers the commands and turns errors into exit statuses."""

import sys

import typer

from drivers.errors import RigError
from rig.commands.arm import arm_app
from rig.commands.calibrate import calibrate_app
from rig.commands.camera import camera_app
from rig.commands.compare import compare
from rig.commands.doctor import EXIT_CODES as DOCTOR_EXIT_CODES
from rig.commands.doctor import doctor
from rig.commands.log import log_app
from rig.commands.measure import measure
from rig.commands.replay import replay
from rig.commands.report import report, runs
from rig.commands.reproduce import reproduce
from rig.commands.run import run
from rig.commands.sim import sim_app
from rig.commands.view import view
from rig.exit_codes import HELP, PLAIN, WITH_DEVICE, ExitCode, exit_code_of, exit_codes
from rig.output import patient_output

app = typer.Typer(
    name="rig",
    help="Active structure from motion: moves a camera and reports the radius and the 3D pose "
    "of a ball or a pipe.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command(epilog=HELP)(run)
app.command(epilog=PLAIN)(measure)
app.command(epilog=exit_codes("a radius was obtained", ExitCode.TARGET_LOST))(replay)
app.command(epilog=HELP)(reproduce)
app.command(epilog=PLAIN)(report)
app.command(epilog=PLAIN)(runs)
app.command(epilog=PLAIN)(view)
app.command(epilog=WITH_DEVICE)(compare)
app.command(epilog=DOCTOR_EXIT_CODES)(doctor)
app.add_typer(calibrate_app, name="calibrate")
app.add_typer(camera_app, name="camera")
app.add_typer(arm_app, name="arm")
app.add_typer(log_app, name="log")
app.add_typer(sim_app, name="sim")


def main() -> None:
    """Run the command line; an error of the rig is one line on stderr and an exit status."""
    with patient_output():
        try:
            app()
        except RigError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(exit_code_of(error))
        except KeyboardInterrupt:
            sys.exit(ExitCode.INTERRUPTED)
