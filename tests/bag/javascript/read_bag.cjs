// Reads an MCAP file with @mcap/core and prints what it holds. Argument: the MCAP file.
const fs = require("fs");
const { McapIndexedReader } = require("@mcap/core");
const { decompress } = require("fzstd");

const bytes = new Uint8Array(fs.readFileSync(process.argv[2]));
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};

(async () => {
  const reader = await McapIndexedReader.Initialize({
    readable,
    decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
  });
  const counts = {};
  let last = 0n, payload = "";
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const topic = reader.channelsById.get(message.channelId).topic;
    counts[topic] = (counts[topic] ?? 0) + 1;
    last = message.logTime;
    if (topic === "/cubli/imu") payload = Buffer.from(message.data).toString("hex");
  }
  const attachments = [];
  for await (const attachment of reader.readAttachments({ validateCrcs: true })) attachments.push(attachment.name);
  console.log(JSON.stringify({ counts, last: last.toString(), payload, attachments, profile: reader.header.profile }));
})();
