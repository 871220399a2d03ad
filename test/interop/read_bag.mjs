// Read .mcap files with Foxglove's own libraries and print every message as one line of JSON.
//
//   node read_bag.mjs FILE...          (with the packages of test_foxglove.py installed beside it)

import { open } from "node:fs/promises";
import { createHash } from "node:crypto";
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import * as fzstd from "fzstd";
import lz4 from "lz4js";

const decompressHandlers = {
  zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))),
  lz4: (data, size) => lz4.decompress(data, Number(size)),
};

function plain(_key, value) {
  if (typeof value === "bigint") return String(value);
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
}

for (const path of process.argv.slice(2)) {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const data = new Uint8Array(Number(length));
      await file.read(data, 0, Number(length), Number(offset));
      return data;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const readers = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    const text = new TextDecoder().decode(schema.data);
    readers.set(channel.id, new MessageReader(parse(text, { ros2: true })));
  }
  for await (const message of reader.readMessages()) {
    const row = {
      topic: reader.channelsById.get(message.channelId).topic,
      log_time: message.logTime,
      publish_time: message.publishTime,
      sequence: message.sequence,
      sha256: createHash("sha256").update(message.data).digest("hex"),
      content: readers.get(message.channelId).readMessage(message.data),
    };
    console.log(JSON.stringify(row, plain));
  }
  for await (const row of reader.readAttachments()) {
    console.log(JSON.stringify({ attachment: row.name, size: row.data.length }, plain));
  }
  await file.close();
}
