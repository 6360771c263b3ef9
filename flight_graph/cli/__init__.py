"""The command line ``flight``."""

import sys


def main() -> int:
    """Run the command line; a FlightError becomes its sentence and status 2."""
    if sys.argv[1:2] == ["node"]:
        from flight_graph.ros import leaving
        leaving.at_once()
    from flight_graph.cli.app import app
    from flight_graph.errors import FlightError
    from flight_graph.text_files import printable, short
    sys.stdout.reconfigure(errors="backslashreplace")  # a pipe of Windows has no Greek letters
    try:
        app()
    except FlightError as error:
        from rich.console import Console
        Console(stderr=True, soft_wrap=True, highlight=False).print("[red]error:[/red] ", end="")
        print(short(printable(str(error)), 8000), file=sys.stderr)
        return 2
    return 0
