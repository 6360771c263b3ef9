"""A viewer as the protocol of Foxglove's WebSocket describes one: subscribes to everything and keeps what comes."""

import json
import struct
import time

from websockets.sync.client import connect

PROTOCOL = "foxglove.sdk.v1"
_MESSAGE, _TIME = 1, 2  # opcodes
_PATIENCE_S = 30.0


class Viewer:
    """channels: topic -> what the server says of it; messages: topic -> [(log time [ns], payload)]."""

    def __init__(self, port: int):
        self.socket = connect(f"ws://127.0.0.1:{port}", subprotocols=[PROTOCOL], max_size=None).__enter__()
        self.channels, self.messages, self.parameters, self.statuses = {}, {}, {}, []
        self.info, self.time_ns, self._topics = None, 0, {}

    def close(self) -> None:
        self.socket.close()

    def ask(self, **what) -> None:
        """Send a request."""
        self.socket.send(json.dumps(what))

    def until(self, holds, what: str) -> None:
        """Take messages until something holds."""
        deadline = time.monotonic() + _PATIENCE_S
        while not holds():
            assert time.monotonic() < deadline, f"within {_PATIENCE_S:g} s it did not come: {what}"
            try:
                self._take(self.socket.recv(timeout=0.2))
            except TimeoutError:
                continue

    def subscribe(self, topics=None) -> None:
        """Subscribe to some of the channels that are known, or all."""
        wanted = [channel for topic, channel in self.channels.items() if topics is None or topic in topics]
        for channel in wanted:
            self._topics[channel["id"]] = channel["topic"]
        self.ask(op="subscribe", subscriptions=[{"id": one["id"], "channelId": one["id"]} for one in wanted])

    def _take(self, data):
        if isinstance(data, str):
            said = json.loads(data)
            if said["op"] == "serverInfo":
                self.info = said
            elif said["op"] == "advertise":
                self.channels |= {channel["topic"]: channel for channel in said["channels"]}
            elif said["op"] == "parameterValues":
                self.parameters |= {one["name"]: one.get("value") for one in said["parameters"]}
            elif said["op"] == "status":
                self.statuses.append(said["message"])
        elif data[0] == _MESSAGE:
            number, stamp = struct.unpack_from("<IQ", data, 1)
            self.messages.setdefault(self._topics[number], []).append((stamp, data[13:]))
        elif data[0] == _TIME:
            self.time_ns = struct.unpack_from("<Q", data, 1)[0]
