// Reads an MCAP file with @mcap/core, the library of Foxglove and its kind, and prints one line of JSON: by topic how many
// messages there are and the first of them, taken apart by its omgidl schema; the metadata. It shares no code with nido.
//
// usage: node read_mcap.mjs FOLDER_OF_NODE_MODULES FILE
// Ends with 1 and a sentence at whatever the library does not accept, with 77 when the library is not there.
import {open, readFile} from "node:fs/promises";
import {createRequire} from "node:module";
import path from "node:path";

const [folder, file] = process.argv.slice(2);
let core, fzstd, idl, cdr;
try {
  const require = createRequire(path.resolve(folder) + "/");
  core = require("@mcap/core");
  fzstd = require("fzstd");
  idl = require("@foxglove/omgidl-parser");
  cdr = require("@foxglove/omgidl-serialization");
} catch (trouble) {
  console.error(trouble.message);
  process.exit(77);
}

const decompressHandlers = {zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size)))};

// Messages, schemas and metadata, by the index; of a file without one (its writer was killed) from front to end.
async function contents() {
  const handle = await open(file);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, length) => {
      const {buffer, bytesRead} = await handle.read({position: Number(offset), buffer: new Uint8Array(Number(length))});
      if (bytesRead !== Number(length)) throw new Error("read beyond the end");
      return buffer;
    },
  };
  const found = {is_indexed: true, schemas: new Map(), channels: new Map(), messages: [], metadata: {}};
  let indexed;
  try {
    indexed = await core.McapIndexedReader.Initialize({readable, decompressHandlers});
  } catch (trouble) {
    found.is_indexed = false;
  }
  if (found.is_indexed) {
    found.schemas = indexed.schemasById;
    found.channels = indexed.channelsById;
    found.chunks = indexed.chunkIndexes.length;
    for await (const message of indexed.readMessages({validateCrcs: true})) found.messages.push(message);
    for await (const one of indexed.readMetadata()) found.metadata[one.name] = Object.fromEntries(one.metadata);
    if (BigInt(found.messages.length) !== indexed.statistics.messageCount) throw new Error("the statistics differ");
    if (indexed.dataSectionCrc === undefined) throw new Error("no checksum of the data");
  } else {
    const stream = new core.McapStreamReader({decompressHandlers, validateCrcs: true});
    stream.append(await readFile(file));
    for (let record; (record = stream.nextRecord()); ) {
      if (record.type === "Schema") found.schemas.set(record.id, record);
      if (record.type === "Channel") found.channels.set(record.id, record);
      if (record.type === "Message") found.messages.push(record);
    }
  }
  await handle.close();
  return found;
}

const found = await contents();
const readers = new Map();
for (const schema of found.schemas.values()) {
  const definitions = idl.parseIDL(new TextDecoder().decode(schema.data));
  readers.set(schema.id, new cdr.MessageReader(schema.name, definitions));
}
const topics = {};
for (const message of found.messages) {
  const channel = found.channels.get(message.channelId);
  const schema = found.schemas.get(channel.schemaId);
  if (channel.messageEncoding !== "cdr" || schema.encoding !== "omgidl") throw new Error(`${channel.topic} is not CDR by omgidl`);
  const value = readers.get(schema.id).readMessage(message.data);
  const topic = (topics[channel.topic] ??= {type: schema.name, count: 0, first: value});
  topic.count++;
  topic.last = value;
}
// arrays as their lengths, numbers beyond JSON's as words
const brief = (key, value) =>
  ArrayBuffer.isView(value) || (Array.isArray(value) && value.length > 3) ? {length: value.length}
  : typeof value === "bigint" ? value.toString() : value;
console.log(JSON.stringify({is_indexed: found.is_indexed, chunks: found.chunks, schemas: found.schemas.size, topics, metadata: found.metadata}, brief));
