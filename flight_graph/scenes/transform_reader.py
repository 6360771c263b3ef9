"""All transforms of a topic as arrays by frame; where its messages are alike but for stamps and numbers, in one go."""

import struct

import numpy as np

from flight_graph.bags.reader import Bag

TYPE = "tf2_msgs/msg/TFMessage"
_PLAIN = b"\x00\x01"  # little-endian CDR, whose eight-byte numbers stand at multiples of eight


def read_transforms(bag: Bag, topic: str) -> dict[tuple[str, str], tuple]:
    """(parent, child) -> log times (n,) [ns], translations (n, 3) [m], quaternions x, y, z, w (n, 4), as written."""
    if topic not in bag or bag.topic(topic).type_name != TYPE or not len(bag.stamps_ns(topic)):
        return {}
    payloads = bag.payloads(topic)
    found = _alike(bag.stamps_ns(topic), payloads) if isinstance(payloads, np.ndarray) else None
    return _one_by_one(bag, topic) if found is None else found


def _alike(stamps_ns, payloads) -> dict | None:
    """The transforms of messages (n, size) that name the same frames, or None where they do not."""
    first = payloads[0].tobytes()
    try:
        places = _places(first)
    except (struct.error, UnicodeDecodeError, ValueError):
        return None
    fixed = np.ones(len(first), bool)
    for _, stamp, numbers in places:
        fixed[stamp:stamp + 8] = fixed[numbers:numbers + 56] = False
    if len({frames for frames, _, _ in places}) < len(places):
        return None
    columns = np.flatnonzero(fixed)
    blocks = np.array_split(payloads, len(payloads) // 4096 + 1)
    if any((block[:, columns] != payloads[0, columns]).any() for block in blocks):
        return None
    values = {frames: np.ascontiguousarray(payloads[:, numbers:numbers + 56]).view("<f8") for frames, _, numbers in places}
    return {frames: (stamps_ns, table[:, :3], table[:, 3:]) for frames, table in values.items()}


def _places(message: bytes) -> list[tuple]:
    """((parent, child), where its stamp is, where its seven numbers are) of each transform of a message."""
    if message[:2] != _PLAIN:
        raise ValueError
    (count,), at, found = struct.unpack_from("<I", message, 4), 8, []
    for _ in range(count):
        stamp = at
        parent, at = _text(message, at + 8)
        child, at = _text(message, at)
        numbers = 4 + (at - 4 + 7) // 8 * 8
        at = numbers + 56
        if at > len(message):
            raise ValueError
        found.append(((parent, child), stamp, numbers))
    return found


def _text(message, at) -> tuple[str, int]:
    """A string, and where what follows begins."""
    (length,) = struct.unpack_from("<I", message, at)
    end = at + 4 + length
    if not 0 < length <= len(message) or end > len(message):
        raise ValueError
    return _name(message[at + 4:end - 1].decode()), (end + 3) // 4 * 4


def _name(frame) -> str:
    return str(frame).lstrip("/")


def _one_by_one(bag, topic) -> dict:
    rows = {}
    for stamp, message in zip(bag.stamps_ns(topic).tolist(), bag.decoded(topic)["transforms"]):
        for one in message:
            frames = _name(one["header"]["frame_id"]), _name(one["child_frame_id"])
            rows.setdefault(frames, []).append((stamp, one["transform"]["translation"], one["transform"]["rotation"]))
    return {frames: tuple(map(np.array, zip(*found))) for frames, found in rows.items()}
