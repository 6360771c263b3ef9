"""Bags with something changed, written anew, so that all their checksums hold."""

from flight_graph.bags.reader import read_bag
from flight_graph.bags.writer import BagWriter


def changed(source, folder, attachments=None, metadata=None, change=lambda topic, number, payload: payload):
    """A copy of a bag with other attachments (name -> content), entries of metadata (name -> entries), and payloads."""
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
            topic = topics[channel.topic]
            writer.write(topic, stamp_ns, change(topic.name, topic.count, payload))
    return folder
