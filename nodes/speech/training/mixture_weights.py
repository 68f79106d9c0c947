#!/usr/bin/env python3
"""Turns the packed mixture weights of a PocketSphinx model (sendump) into the plain ones that sphinxtrain reads.

    mixture_weights.py sendump mixture_weights
"""

import array
import math
import struct
import sys

# a packed weight is -log to the base 1.0001, in steps of 2^10
STEP = 1024 * math.log(1.0001)


def main(packed_file: str, plain_file: str) -> None:
    data = open(packed_file, "rb").read()
    offset = 0

    def integer() -> int:
        nonlocal offset
        value = struct.unpack_from("<i", data, offset)[0]
        offset += 4
        return value

    # the header is strings with their lengths before them, ended by a length of 0
    streams = 1
    while length := integer():
        line = data[offset : offset + length].rstrip(b"\0").decode()
        offset += length
        if line.startswith("feature_count"):
            streams = int(line.split()[1])
    densities, senones = integer(), integer()
    weight = [math.exp(-value * STEP) for value in range(256)]

    # packed: stream, density, senone; plain: senone, stream, density
    plain = array.array("f", bytes(4 * senones * streams * densities))
    for stream in range(streams):
        for density in range(densities):
            start = offset + (stream * densities + density) * senones
            plain[stream * densities + density :: streams * densities] = array.array(
                "f", [weight[value] for value in data[start : start + senones]]
            )
    with open(plain_file, "wb") as out:
        out.write(b"s3\nversion 1.0\nendhdr\n")
        out.write(struct.pack("<5i", 0x11223344, senones, streams, densities, len(plain)))
        plain.tofile(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
