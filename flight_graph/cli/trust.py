"""Asking whether code may run that does not come with the packages."""

import sys
from typing import Annotated

import typer

from flight_graph.cli.show import without_bar
from flight_graph.text_files import printable

Trust = Annotated[bool, typer.Option(
    "--trust", help="Run the code that the file names beyond the packages. Read it first.")]


def asked(trust: bool):
    """The consent of the command line: given with --trust; at a terminal it is asked; else it is refused."""
    from flight_graph.components.foreign import agree, refuse
    if trust:
        return agree
    return _ask if sys.stdin.isatty() and sys.stderr.isatty() else refuse


def once(consent):
    """A consent that asks about each piece of code once, and keeps to the answer."""
    from flight_graph.components.foreign import Untrusted, refuse
    answers = {}

    def remembered(where, found):
        news = [code for code in found if answers.get(code) is None]
        if any(answers.get(code) is False for code in found):
            refuse(where, found)
        if not news:
            return
        try:
            consent(where, news)
        except Untrusted:
            answers.update(dict.fromkeys(news, False))
            raise
        answers.update(dict.fromkeys(news, True))
    return remembered


def _ask(where, found) -> None:
    """Show what would run, and ask. Raises Untrusted."""
    from flight_graph.components.foreign import refuse
    lines = [f"{where} names code that does not come with the packages; it would run with all your rights:",
             *(f"  {code}" for code in found)]
    with without_bar():
        print(printable("\n".join(lines)), file=sys.stderr)
        agreed = typer.confirm("Have you read it, and shall it run?", default=False, err=True)
    if not agreed:
        refuse(where, found)
