"""A number's last seconds as a picture."""

from pathlib import Path

from flight_graph.errors import FlightError


def draw(times, values, label: str, path: Path | None = None) -> Path:
    """Draw (n, m) numbers over (n,) times [s]; return the file. path: by default the next free ``plot_N.png``."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    if path is None:
        number = 1
        while (path := Path(f"plot_{number}.png")).exists():
            number += 1
    figure, axes = pyplot.subplots(figsize=(8, 4.5), layout="constrained")
    try:
        for column in range(values.shape[1]):
            axes.plot(times, values[:, column], linewidth=1.2, label=f"[{column}]")
        axes.set(xlabel="t [s]", ylabel=label)
        if values.shape[1] > 1:
            axes.legend()
        axes.grid(alpha=0.3)
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise FlightError(f"'{path}' cannot be written: {reason}") from None
    finally:
        pyplot.close(figure)
    return path
