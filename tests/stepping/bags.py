"""Bags with something changed, written anew, so that all their checksums hold."""

from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter


def changed(source, folder, attachments=None, metadata=None):
    """A copy of a bag with other attachments (name -> content) and entries of metadata (name -> entries)."""
    bag = read_bag(source)
    with BagWriter(folder) as writer:
        for record in bag.all_attachments:
            writer.attach(record.name, record.media_type, (attachments or {}).get(record.name, bytes(record.data)))
        for record in bag.all_metadata:
            if record.name != "rosbag2":
                writer.metadata(record.name, {**record.metadata, **(metadata or {}).get(record.name, {})})
        topics = {}
        for channel, schema, stamp_ns, _, payload in bag.records():
            if channel.topic not in topics:
                topics[channel.topic] = writer.add_channel(
                    channel.topic, channel.message_encoding, channel.metadata, (schema.name, schema.encoding, schema.data))
            writer.write(topics[channel.topic], stamp_ns, payload)
    return folder
