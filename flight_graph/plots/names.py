"""What bags are called in legends, and where files beside them go."""

from pathlib import Path

from flight_graph.errors import FlightError


def run_names(bags: list[Path]) -> list[str]:
    """A name for each bag: that of its file or folder; where two share it, with as much of the path as tells them apart."""
    resolved = [Path(bag).resolve() for bag in bags]
    plain = [bag.name.removesuffix(".zstd").removesuffix(".mcap").removesuffix(".db3") for bag in resolved]
    names = []
    for bag, name in zip(resolved, plain):
        others = [other for other, same in zip(resolved, plain) if same == name and other != bag]
        depth = 1
        while any(other.parts[-depth:] == bag.parts[-depth:] for other in others):
            depth += 1
        name = name if depth == 1 else "/".join([*bag.parts[-depth:-1], name])
        names.append(name if name not in names else f"{name} ({len(names) + 1})")
    return names


def beside(bag: Path, ending: str, option: str = "--out") -> Path:
    """A file beside a bag, which whoever made the bag may have made as well. Raises FlightError where a link lies there,
    with the option that names another place."""
    bag = Path(bag)
    name = bag.name.removesuffix(".zstd").removesuffix(".mcap") or bag.resolve().name
    path = bag.parent / f"{name}{ending}"
    if path.is_symlink():
        raise FlightError(f"'{path}' is a link to another place; name where to write with {option}")
    return path
