"""What a file is, by its first bytes: people hand over whatever stands in the folder of a bag."""

from pathlib import Path

from flight_graph.bags.errors import BagError

SQLITE = b"SQLite format 3\0"
_OTHERS = {  # first bytes -> what to say
    b"version https://git-lfs": "is a Git LFS pointer, not the bag itself; fetch it (git lfs pull), then try again",
    b"#ROSBAG V": "is a bag of ROS 1; convert it first (rosbags-convert)",
    b"PAR1": "is a Parquet table, not a bag",
    b"PK\x03\x04": "is a zip archive; unpack it, then name the bag inside",
    b"\x1f\x8b": "is compressed by gzip; unpack it first",
    b"rosbag2_bagfile_information": "is the description of a bag; name its folder",
}


def refuse_other_kind(path: Path, head: bytes) -> None:
    """Raise BagError where the first bytes say that this is no bag at all; nothing could be recovered from it."""
    for start, sentence in _OTHERS.items():
        if head.startswith(start):
            raise BagError(f"'{path}' {sentence}")
    text = head.strip()
    if text and all(byte in b"\t\r\n" or 32 <= byte < 127 for byte in text):
        raise BagError(f"'{path}' is a text file, not a bag; an .mcap or .db3 file is read, or the folder of one")


def is_sqlite(path: Path) -> bool:
    """Whether a file is an SQLite database (rosbag2's .db3), maybe compressed as a whole."""
    if path.name.endswith(".db3.zstd"):
        return True
    with open(path, "rb") as file:
        return file.read(len(SQLITE)) == SQLITE
