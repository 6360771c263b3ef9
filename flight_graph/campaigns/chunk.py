"""One chunk of a campaign as a file: part-000123.parquet, whole or not there, with a digest over its rows.

The digest is over names, types and values, not over the bytes of the file: it is the same on every machine and with every
version of Parquet. Each column has its own; that of the rows is the digest of those. Which machine made the part stands
beside it, and is no part of it.
"""

import contextlib
import hashlib
import io
import json
import os
import platform
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet

from flight_graph.campaigns.rows import type_text
from flight_graph.errors import FlightError
from flight_graph.recordings.recording import processor
from flight_graph.text_files import size_text

KEY = b"flight_campaign"
NAME = re.compile(r"part-(\d{6,})\.parquet")
LARGEST = 1 << 30  # [bytes] of one part, unpacked
MOST_ROWS = 100_000  # of one part


class Damaged(FlightError):
    """A part that is cut short, or whose rows are not those that it was written with."""


@dataclass(frozen=True)
class Part:
    """A chunk that was read. campaign: identity of the campaign that it belongs to; digest: of its rows; host, cpu: of the
    machine that made it. table: the columns that were asked for.
    """

    number: int
    campaign: str
    digest: str
    host: str
    cpu: str
    rows: int
    table: pyarrow.Table


def part_name(number: int) -> str:
    """The file of a chunk."""
    return f"part-{number:06d}.parquet"


def digest(table: pyarrow.Table) -> str:
    """SHA-256 over the rows of a table: of the digests of its columns."""
    return _digest_of(column_digests(table))


def column_digests(table: pyarrow.Table) -> dict[str, str]:
    """name -> SHA-256 of a column: its type, which values are missing, and the values."""
    found = {}
    for name in table.schema.names:
        column = table.column(name).combine_chunks()
        if isinstance(column, pyarrow.ChunkedArray):
            column = pyarrow.concat_arrays(column.chunks) if column.num_chunks else pyarrow.array([], column.type)
        state = hashlib.sha256(f"{name}\0{type_text(column.type)}\0{len(column)}\0".encode())
        _feed(state, column)
        found[name] = state.hexdigest()
    return found


def _digest_of(digests: dict[str, str]) -> str:
    return hashlib.sha256(json.dumps(digests).encode()).hexdigest()


def _feed(state, column):
    kind, valid = column.type, np.asarray(column.is_valid().to_numpy(zero_copy_only=False), np.uint8)
    state.update(valid.tobytes())
    if pyarrow.types.is_null(kind):
        return
    if pyarrow.types.is_fixed_size_list(kind):
        _feed(state, column.flatten())  # of the rows that are there
    elif pyarrow.types.is_string(kind):
        texts = [text.encode() for text in column.drop_null().to_pylist()]
        state.update(np.array([len(text) for text in texts], "<i8").tobytes() + b"".join(texts))
    else:
        letter = {"double": "<f8", "int64": "<i8", "bool": "|u1"}[str(kind)]
        state.update(column.drop_null().to_numpy(zero_copy_only=False).astype(letter).tobytes())


@cache
def machine() -> tuple[str, str]:
    """(host name, processor) of this machine."""
    return platform.node(), processor()


def encode(table: pyarrow.Table, campaign: str, number: int) -> bytes:
    """The file of a chunk: the same bytes for the same rows on one machine."""
    columns = column_digests(table)
    host, cpu = machine()
    about = {"campaign": campaign, "chunk": number, "rows": table.num_rows, "digest": _digest_of(columns),
             "columns": columns, "host": host, "cpu": cpu}
    table = table.replace_schema_metadata({KEY: json.dumps(about)})
    sink = io.BytesIO()
    pyarrow.parquet.write_table(table, sink, compression="zstd", write_statistics=False, write_page_checksum=True)
    return sink.getvalue()


def about_of(metadata, what: str) -> dict:
    """What a part says of itself. Raises Damaged."""
    try:
        about = json.loads((metadata or {})[KEY])
        columns, rows = about["columns"], about["rows"]
        if about["digest"] != _digest_of(columns) or not isinstance(rows, int) or not isinstance(about["chunk"], int):
            raise ValueError("its digest is not that of its columns")
        return {**about, "host": str(about.get("host", "?")), "cpu": str(about.get("cpu", "?"))}
    except (KeyError, ValueError, TypeError) as error:
        raise Damaged(f"{what} is damaged: {error}") from None


def decode(source, what: str, columns: list[str] | None = None) -> Part:
    """Read a part (a path, or bytes), and see that its rows are those it was written with. columns: those that are wanted;
    None: all. Raises Damaged, which begins with ``what``."""
    try:
        file = pyarrow.parquet.ParquetFile(io.BytesIO(source) if isinstance(source, bytes) else source,
                                           page_checksum_verification=True)
        with file:
            about = about_of(file.schema_arrow.metadata, what)
            size = sum(file.metadata.row_group(i).total_byte_size for i in range(file.num_row_groups))
            if file.metadata.num_rows > MOST_ROWS or size > LARGEST:
                claimed = f"{file.metadata.num_rows} rows of {size_text(size)}"
                raise Damaged(f"{what} claims {claimed}, more than is read of a part")
            wanted = None if columns is None else [name for name in columns if name in file.schema_arrow.names]
            table = file.read(columns=wanted)
    except FileNotFoundError:
        raise
    except Damaged:
        raise
    except (pyarrow.ArrowException, OSError, ValueError, KeyError) as error:
        raise Damaged(f"{what} is damaged: {str(error).splitlines()[0]}") from None
    found = column_digests(table)
    wrong = [name for name, value in found.items() if about["columns"].get(name) != value]
    if wrong or (columns is None and list(about["columns"]) != list(found)):
        raise Damaged(f"{what} is damaged: its rows are not those it was written with ({', '.join(wrong) or 'columns'})")
    return Part(about["chunk"], about["campaign"], about["digest"], about["host"], about["cpu"], about["rows"],
                table.replace_schema_metadata(None))


def write_durably(path: Path, content: bytes, replace: bool = True, hint: str = "") -> bool:
    """Write a file whole: to a temporary name, synced, then under its own. Raises FlightError (disk full, read-only).

    replace: False leaves a file that is there, and says so by returning False. hint: how to go on, the end of the sentence.
    """
    draft = path.with_name(f".{path.name}.{platform.node()}.{os.getpid()}.{os.urandom(4).hex()}.tmp")
    try:
        with open(draft, "xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if replace or not _linked(draft, path):
            os.replace(draft, path)
        _sync_folder(path.parent)
    except FileExistsError:
        return False
    except OSError as error:
        raise FlightError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}; nothing that was there is "
                          f"lost{hint}") from None
    finally:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)
    return True


def _linked(draft: Path, path: Path) -> bool:
    """Give the file its name, unless it is taken; False where the disk knows no links. Raises FileExistsError."""
    if not hasattr(os, "link"):
        return False
    try:
        os.link(draft, path)
        return True
    except FileExistsError:
        raise
    except (OSError, NotImplementedError):
        if path.exists():
            raise FileExistsError from None
        return False


def _sync_folder(folder: Path):
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
