"""std_msgs/String as bytes, without message objects."""

from msg_schemas.signal import ENCAPSULATION

TYPE = "std_msgs/msg/String"


def text_payload(text: str) -> bytes:
    """A serialised std_msgs/String."""
    encoded = text.encode() + b"\0"
    return ENCAPSULATION + len(encoded).to_bytes(4, "little") + encoded


def text_of(payload: bytes) -> str:
    """The text of a serialised std_msgs/String."""
    return bytes(payload[8:7 + int.from_bytes(payload[4:8], "little")]).decode()
