#!/usr/bin/env python3
"""Checks an MCAP file against the specification (https://mcap.dev/spec), sharing no code with nido's own reader.

usage: check_mcap.py FILE
Prints one line of JSON: the messages by topic, the schemas by name, the metadata. Ends with 1 and a sentence at the first thing
that the specification does not allow.
"""
import ctypes
import ctypes.util
import json
import struct
import sys
import zlib

MAGIC = b"\x89MCAP0\r\n"


def demand(holds, sentence):
    if not holds:
        sys.exit(f"not as specified: {sentence}")


def unzstd(packed, size):
    library = ctypes.CDLL(ctypes.util.find_library("zstd") or "libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    place = ctypes.create_string_buffer(max(size, 1))
    got = library.ZSTD_decompress(place, ctypes.c_size_t(size), packed, ctypes.c_size_t(len(packed)))
    demand(got == size, f"a chunk unpacks to {got} bytes instead of {size}")
    return place.raw[:size]


class Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, code):
        size = struct.calcsize("<" + code)
        demand(self.at + size <= len(self.data), "a record ends in the middle of a field")
        value = struct.unpack_from("<" + code, self.data, self.at)[0]
        self.at += size
        return value

    def bytes(self, length):
        demand(self.at + length <= len(self.data), "a record ends in the middle of a field")
        self.at += length
        return self.data[self.at - length:self.at]

    def text(self):
        return self.bytes(self.number("I")).decode("utf-8")

    def pairs(self, key, value):
        inner, found = Fields(self.bytes(self.number("I"))), {}
        while inner.at < len(inner.data):
            name = key(inner)
            demand(name not in found, "a map has a key twice")
            found[name] = value(inner)
        return found

    def rest(self):
        return self.data[self.at:]


def records_of(data, start, end):
    at = start
    while at < end:
        demand(at + 9 <= end, "a record's head does not fit")
        op, length = struct.unpack_from("<BQ", data, at)
        demand(at + 9 + length <= end, f"record {op:#x} at {at} does not fit")
        yield op, at, data[at + 9:at + 9 + length]
        at += 9 + length
    demand(at == end, "a section ends in the middle of a record")


def text(fields):
    return fields.text()


class File:
    def __init__(self, data):
        self.data = data
        self.schemas, self.channels, self.counts, self.metadata = {}, {}, {}, []
        self.times = []

    def schema(self, content):
        f = Fields(content)
        one = (f.number("H"), f.text(), f.text(), bytes(f.bytes(f.number("I"))))
        demand(one[0] != 0, "a schema has id 0")
        demand(self.schemas.setdefault(one[0], one) == one, f"schema {one[0]} comes twice and differs")

    def channel(self, content):
        f = Fields(content)
        one = (f.number("H"), f.number("H"), f.text(), f.text(), f.pairs(text, text))
        demand(one[1] == 0 or one[1] in self.schemas, f"channel {one[2]} comes before its schema")
        demand(self.channels.setdefault(one[0], one) == one, f"channel {one[0]} comes twice and differs")

    def message(self, content):
        f = Fields(content)
        channel, _, log_time, _ = f.number("H"), f.number("I"), f.number("Q"), f.number("Q")
        demand(channel in self.channels, f"a message comes before its channel {channel}")
        self.counts[channel] = self.counts.get(channel, 0) + 1
        self.times.append(log_time)
        return channel, log_time

    def chunk(self, content):
        f = Fields(content)
        start, end, size, crc = f.number("Q"), f.number("Q"), f.number("Q"), f.number("I")
        compression, packed = f.text(), f.bytes(f.number("Q"))
        demand(compression in ("", "zstd"), f"compression '{compression}'")
        inner = bytes(packed) if compression == "" else unzstd(bytes(packed), size)
        demand(len(inner) == size, "a chunk's uncompressed size is wrong")
        demand(crc in (0, zlib.crc32(inner)), "a chunk's checksum is wrong")
        index, times = {}, []
        for op, at, record in records_of(inner, 0, len(inner)):
            demand(op in (3, 4, 5), f"record {op:#x} inside of a chunk")
            if op == 3:
                self.schema(record)
            elif op == 4:
                self.channel(record)
            else:
                channel, log_time = self.message(record)
                index.setdefault(channel, []).append((log_time, at))
                times.append(log_time)
        demand((start, end) == ((min(times), max(times)) if times else (0, 0)), "a chunk's times are wrong")
        return {"start": start, "end": end, "compression": compression, "packed": len(packed), "size": size, "index": index}

    def check(self):
        data = self.data
        demand(data.startswith(MAGIC) and data.endswith(MAGIC), "the magic bytes are not at both ends")
        footer_at = len(data) - 8 - 29
        op, length = struct.unpack_from("<BQ", data, footer_at)
        demand((op, length) == (2, 20), "the footer is not at the end")
        summary_start, offset_start, summary_crc = struct.unpack_from("<QQI", data, footer_at + 9)
        demand(summary_crc in (0, zlib.crc32(data[summary_start:footer_at + 25])), "the summary's checksum is wrong")
        self.data_section(summary_start)
        self.summary(summary_start, offset_start, footer_at)

    def data_section(self, end):
        self.chunks, self.metadata_at, waiting, ended = [], {}, {}, False
        for op, at, content in records_of(self.data, 8, end):
            demand(not ended, "something comes between the end of the data and the summary")
            demand((op == 1) == (at == 8), "the header is not the first record, or comes twice")
            demand(not waiting or op == 7, "a chunk is not followed by the index of each of its channels")
            if op == 3:
                self.schema(content)
            elif op == 4:
                self.channel(content)
            elif op == 5:
                self.message(content)
            elif op == 6:
                chunk = self.chunk(content)
                chunk.update(at=at, length=len(content) + 9, index_at={}, index_length=0)
                self.chunks.append(chunk)
                waiting = dict(chunk["index"])
            elif op == 7:
                f = Fields(content)
                channel, entries, inner = f.number("H"), [], Fields(f.bytes(f.number("I")))
                while inner.at < len(inner.data):
                    entries.append((inner.number("Q"), inner.number("Q")))
                demand(waiting.pop(channel, None) == entries, f"the index of channel {channel} is wrong")
                self.chunks[-1]["index_at"][channel] = at
                self.chunks[-1]["index_length"] += len(content) + 9
            elif op == 12:
                f = Fields(content)
                name = f.text()
                self.metadata.append((name, f.pairs(text, text)))
                self.metadata_at[at] = (len(content) + 9, name)
            elif op == 15:
                crc = Fields(content).number("I")
                demand(crc in (0, zlib.crc32(self.data[:at])), "the checksum of the data is wrong")
                ended = True
            else:
                demand(op in (1, 9) or op >= 0x80, f"record {op:#x} in the data section")
        demand(ended, "the data section has no end")

    def summary(self, start, offset_start, end):
        groups, order, indexes, metadata = {}, [], [], {}
        schemas, channels = set(), set()
        for op, at, content in records_of(self.data, start, offset_start or end):
            if not order or order[-1] != op:
                order.append(op)
                groups[op] = [at, 0]
            groups[op][1] += len(content) + 9
            f = Fields(content)
            if op == 3:
                self.schema(content)
                schemas.add(f.number("H"))
            elif op == 4:
                self.channel(content)
                channels.add(f.number("H"))
            elif op == 8:
                indexes.append(f)
            elif op == 11:
                self.statistics(f, channels)
            elif op == 13:
                offset, length = f.number("Q"), f.number("Q")
                metadata[offset] = (length, f.text())
            else:
                demand(op == 10, f"record {op:#x} in the summary")
        demand(len(order) == len(set(order)), "the records of the summary are not grouped")
        demand(metadata == self.metadata_at, "the metadata index is wrong")
        demand(channels == set(self.channels) and schemas == set(self.schemas), "the summary lacks channels or schemas")
        demand(len(indexes) == len(self.chunks), "not every chunk has an index")
        for f, chunk in zip(indexes, self.chunks):
            found = [f.number("Q"), f.number("Q"), f.number("Q"), f.number("Q"),
                     f.pairs(lambda g: g.number("H"), lambda g: g.number("Q")), f.number("Q"), f.text(), f.number("Q"), f.number("Q")]
            demand(found == [chunk[key] for key in ("start", "end", "at", "length", "index_at", "index_length", "compression",
                                                    "packed", "size")], "a chunk index is wrong")
        if offset_start:
            said = {}
            for op, _, content in records_of(self.data, offset_start, end):
                demand(op == 14, f"record {op:#x} in the summary offset section")
                f = Fields(content)
                group = f.number("B")
                said[group] = [f.number("Q"), f.number("Q")]
            demand(said == groups, "the summary offsets are wrong")

    def statistics(self, f, channels):
        found = [f.number(code) for code in "QHIIIIQQ"]
        counts = f.pairs(lambda g: g.number("H"), lambda g: g.number("Q"))
        times = (min(self.times), max(self.times)) if self.times else (0, 0)
        demand(found == [len(self.times), len(self.schemas), len(self.channels), 0, len(self.metadata), len(self.chunks), *times],
               f"the statistics are wrong: {found}")
        demand({id: n for id, n in counts.items() if n} == self.counts, "the message counts are wrong")
        demand(set(counts) <= channels, "the statistics come before the channels that they count")


def main():
    with open(sys.argv[1], "rb") as source:
        file = File(source.read())
    file.check()
    print(json.dumps({
        "messages": {channel[2]: file.counts.get(id, 0) for id, channel in file.channels.items()},
        "encodings": sorted({channel[3] for channel in file.channels.values()}),
        "schemas": {one[1]: one[2] for one in file.schemas.values()},
        "metadata": dict(file.metadata)}))


if __name__ == "__main__":
    main()
