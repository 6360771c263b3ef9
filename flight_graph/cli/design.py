"""flight design: parameters that keep a promise, with the argument for them."""
import typer
def register(app: typer.Typer) -> None:
    pass
