#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads a polarscan session without polarscan (docs/session.md): lists its frames, or yields them to your program.

    python3 read_session.py SESSION

Needs nothing but Python; with python3-xxhash checksums are compared, with python3-numpy samples() unpacks frames."""
import json, struct, sys
from pathlib import Path

try:
    from xxhash import xxh3_64_intdigest as checksum
except ImportError:
    checksum = None

MAGIC = b"PSCRECRD"
HEADER = struct.Struct("<8sIIQQQqqIIIIdddQ48s64sQQQQQ")
FIELDS = ("magic version type session index sequence camera_time_ns host_time_ns width height stride zero exposure_us gain_db "
          "temperature_c shot pixel_format name payload_bytes payload_hash missing zero2 header_hash").split()


def header_at(data, at, session):
    """The header at an offset as a dictionary, or None if there is no whole record."""
    if data[at:at + 8] != MAGIC or at + HEADER.size > len(data):
        return None
    h = dict(zip(FIELDS, HEADER.unpack_from(data, at)))
    if checksum and checksum(data[at:at + 248]) != h["header_hash"]:
        return None
    if h["version"] != 1 or h["session"] != session or at + HEADER.size + h["payload_bytes"] > len(data):
        return None
    for key in ("pixel_format", "name"):
        h[key] = h[key].split(b"\0")[0].decode()
    return h


def frames(folder):
    """(header, payload) of every whole frame, in order. What is damaged or unfinished is passed over."""
    session = int(json.loads((Path(folder) / "session.json").read_text())["id"], 16)
    for segment in sorted((Path(folder) / "segments").glob("*.seg")):
        data, at = segment.read_bytes(), 0
        while at >= 0:
            h = header_at(data, at, session)
            if h is None:
                at = data.find(MAGIC, at + 1)
                continue
            payload = data[at + HEADER.size:at + HEADER.size + h["payload_bytes"]]
            if h["type"] == 0 and (not checksum or checksum(payload) == h["payload_hash"]):
                yield h, payload
            at += HEADER.size + h["payload_bytes"]


def samples(h, payload):
    """A frame's counts as a numpy array of height x width; formats 8, 10, 12, 16, 12p, 12Packed without padding."""
    import numpy
    depth, shape = h["pixel_format"].lstrip("MonoPlarizeBayRGGB"), (h["height"], h["width"])
    if depth in ("8", "10", "12", "14", "16"):
        return numpy.frombuffer(payload, "u1" if depth == "8" else "<u2").reshape(shape)
    if depth not in ("12p", "12Packed"):
        raise ValueError(h["pixel_format"] + " is not unpacked here")
    a, b, c = numpy.frombuffer(payload, "u1").reshape(-1, 3).T.astype("u2")
    pair = (a | (b & 15) << 8, b >> 4 | c << 4) if depth == "12p" else (a << 4 | b & 15, c << 4 | b >> 4)
    return numpy.stack(pair, axis=1).reshape(shape)


if __name__ == "__main__":
    for h, payload in frames(sys.argv[1]):
        print(h["sequence"], h["shot"], h["name"], h["pixel_format"], f'{h["width"]}x{h["height"]}', len(payload), "bytes")
