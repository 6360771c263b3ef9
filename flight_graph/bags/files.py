"""The files of a bag: what metadata.yaml of any version names, or what stands in the folder where there is none."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from flight_graph.bags.description import FILE_NAME, from_yaml, read_description
from flight_graph.bags.errors import BagError
from flight_graph.bags.journal import FILE_NAME as MARK
from flight_graph.bags.journal import is_live
from flight_graph.bags.mcap_file import LIBRARY
from flight_graph.bags.mcap_records import Damage

KINDS = (".mcap", ".mcap.zstd", ".db3", ".db3.zstd")
_STORAGES = ("mcap", "sqlite3", "", None)  # `ros2 bag reindex` of Humble leaves it empty


@dataclass(frozen=True)
class Source:
    """files: of the bag, in its order. description: content of metadata.yaml, or None. remarks: for a person.
    fault: what is wrong with metadata.yaml."""

    files: list[Path]
    description: dict | None = None
    remarks: list[str] = field(default_factory=list)
    fault: str = ""  # of metadata.yaml


def find_files(path: Path) -> Source:
    """The files of a bag: a folder's, or the one file. Raises BagError, Damage or OSError."""
    if not path.is_dir():
        return Source([path])
    if (path / MARK).exists():
        if is_live(path):
            raise BagError(f"bag '{path}' is still being recorded")
        raise Damage("its recorder was stopped before it could finish")
    if not (path / FILE_NAME).exists():
        files = in_folder(path)
        if not files:
            raise BagError(f"'{path}' is no bag: it holds neither {FILE_NAME} nor an .mcap or .db3 file")
        return Source(files, None, [f"{path}: {FILE_NAME} is missing; all files were read, in the order of their names"])
    try:
        description = read_description(path)
    except ValueError as error:
        return _without(path, str(error))
    if not description["relative_file_paths"]:
        return _without(path, f"{FILE_NAME} names no file")
    storage = description.get("storage_identifier")
    if storage not in _STORAGES:
        raise BagError(f"bag '{path}': {FILE_NAME} names the storage '{storage}'; mcap and sqlite3 are read")
    return Source(_named(path, description), description)


def _without(path, fault):
    """What stands beside a metadata.yaml that says nothing."""
    files = in_folder(path)
    if not files:
        raise Damage(fault)
    return Source(files, None, [f"{path}: {fault}; all files were read, in the order of their names"], fault)


def in_folder(path: Path) -> list[Path]:
    """The MCAP and SQLite files of a folder in their order: bag_2 before bag_10; a compressed copy of one is left out."""
    files = [file for file in path.iterdir() if file.is_file() and file.name.endswith(KINDS)]
    names = {file.name for file in files}
    files = [file for file in files if not (file.suffix == ".zstd" and file.stem in names)]
    return sorted(files, key=lambda file: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", file.name)])


def _named(path, description):
    """The files that metadata.yaml names; older ones are named with their folder, or without the ending of compression."""
    files = []
    for name in dict.fromkeys(map(str, description["relative_file_paths"])):
        file = path / Path(name.replace("\\", "/")).name
        packed = file.with_name(file.name + ".zstd")
        files.append(packed if not file.exists() and packed.exists() else file)
    missing = [file.name for file in files if not file.exists()]
    if missing:
        raise Damage(f"its file {missing[0]} is missing")
    return files


def check_description(source: Source, contents: list) -> list[str]:
    """Compare metadata.yaml, which has no checksum, with the files. Returns remarks. Raises Damage for our own bags."""
    description = source.description
    ours = contents[0].library == LIBRARY
    if source.fault and ours:
        raise Damage(source.fault)
    if description is None:
        return []
    for record in contents[0].metadata:
        if record.name == "rosbag2" and ours and from_yaml(record.metadata["serialized_metadata"]) != description:
            raise Damage(f"{FILE_NAME} differs from the copy inside {source.files[0].name}")
    count, counted = sum(len(part.messages.channel) for part in contents), description.get("message_count")
    if counted in (count, None):
        return []
    sentence = f"{FILE_NAME} counts {counted} messages, the bag holds {count}"
    if ours:
        raise Damage(sentence)
    return [f"{source.files[0].parent}: {sentence}"]
