"""Binary messages: those that YARP writes, and those that nobody should."""
import random
import socket
import struct
import threading
import unittest

import nido
from nido import robot, wire


def words(*numbers):
    return struct.pack(f"<{len(numbers)}i", *numbers)


STRING = lambda value: words(4, len(value)) + value
PAIRS = (words(256, 3) +
         words(256, 2) + STRING(b"x") + words(10) + struct.pack("<d", 2.5) +
         words(256, 2) + STRING(b"on") + words(256 + 9, 2) + b"1\0\0\0" + b"\0\0\0\0" +
         words(256, 2) + STRING(b"name") + words(256 + 4, 2) + words(1) + b"a" + words(2) + b"bc")


def picture(width, height, quantum=8):
    row = 3 * width
    step = -(-row // quantum) * quantum
    pixels = b"".join(bytes((x + y) % 256 for x in range(row)) + b"\xee" * (step - row) for y in range(height))
    word = lambda letters: struct.unpack("<i", letters.ljust(4, b"\0"))[0]
    return words(256, 4, 9, word(b"mat"), 9, word(b"rgb"), 257, 5, 3, len(pixels), quantum, width, height, 12,
                 len(pixels)) + pixels


class Bottles(unittest.TestCase):
    def test_lists_of_all_kinds(self):
        self.assertEqual(wire.decode(words(256 + 1, 3, 1, 2, 3)), [1, 2, 3])
        self.assertEqual(wire.decode(words(256 + 10, 2) + struct.pack("<2d", 0.5, -1)), [0.5, -1.0])
        self.assertEqual(wire.decode(words(256, 0)), [])
        self.assertEqual(wire.decode(words(256, 2) + words(17) + struct.pack("<q", 1 << 40) + words(12, 2) + b"\0\1"),
                         [1 << 40, b"\0\1"])

    def test_pairs_become_a_dict(self):
        value = nido.system.text.named(wire.decode(PAIRS))
        self.assertEqual(value, {"x": 2.5, "on": [True, False], "name": ["a", "bc"]})

    def test_malformed_ones_are_refused(self):
        source = random.Random(1)
        refused = 0
        for _ in range(20000):
            mutated = bytearray(PAIRS[:source.randrange(1, len(PAIRS) + 1)])
            for _ in range(source.randrange(4)):
                mutated[source.randrange(len(mutated))] = source.randrange(256)
            try:
                wire.decode(bytes(mutated))
            except nido.Error:
                refused += 1
        self.assertGreater(refused, 5000)
        with self.assertRaises(nido.Error):
            wire.decode(words(256, 1) * 2000)


class Pictures(unittest.TestCase):
    def test_padding_is_cut_off(self):
        image = robot._image_of(nido.Message(1, 2.0, picture(5, 4)))
        self.assertEqual((image.width, image.height, len(image.data)), (5, 4, 60))
        self.assertEqual(image.pixel(1, 2), (5, 6, 7))

    def test_malformed_ones_are_refused(self):
        good = picture(4, 4)
        for bad in (good[:50], good[:-1], good.replace(b"mat", b"cat"), b"\0" * 100):
            with self.assertRaises(nido.Error):
                robot._image_of(nido.Message(1, 0.0, bad))


class Streams(unittest.TestCase):
    """A far side that sends what it likes."""

    def serve(self, *pieces):
        listener = socket.socket()
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        self.addCleanup(listener.close)

        def run():
            far, _ = listener.accept()
            with far:
                far.recv(1000)
                far.sendall(wire._FAST_TCP)
                for piece in pieces:
                    far.sendall(piece)
                far.shutdown(socket.SHUT_WR)
                while far.recv(1000):  # closed before all is read, the connection would be reset
                    pass
        thread = threading.Thread(target=run)
        thread.start()
        self.addCleanup(thread.join)
        stream = wire.Stream(listener.getsockname(), "/me", 5)
        self.addCleanup(stream.close)
        return stream

    @staticmethod
    def message(content, envelope=b"D 7 1.5\0"):
        body = words(len(envelope)) + b"~\0\0\1" + envelope + content
        return wire._INDEX + bytes([1, 1] + [255] * 8) + words(len(body), 0) + body

    def test_messages_in_pieces(self):
        whole = self.message(b"one") + self.message(b"two")
        stream = self.serve(*[whole[at:at + 5] for at in range(0, len(whole), 5)])
        self.assertEqual(stream.read(5), (7, 1.5, b"one"))
        self.assertEqual(stream.read(5), (7, 1.5, b"two"))

    def test_an_end_and_nonsense_are_told(self):
        with self.assertRaises(nido.NotFound):
            self.serve(self.message(b"one")[:30]).read(5)
        with self.assertRaises(nido.Error):
            self.serve(b"x" * 100).read(5)
        with self.assertRaises(nido.Error):
            self.serve(wire._INDEX + bytes([1, 1] + [255] * 8) + words(1 << 30, 0)).read(5)

    def test_a_wait_that_was_in_vain_loses_nothing(self):
        whole = self.message(b"late")
        gate = threading.Event()
        listener = socket.socket()
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        self.addCleanup(listener.close)

        def run():
            far, _ = listener.accept()
            with far:
                far.recv(1000)
                far.sendall(wire._FAST_TCP + whole[:40])
                gate.wait(10)
                far.sendall(whole[40:])
                far.shutdown(socket.SHUT_WR)
                while far.recv(1000):  # as above
                    pass
        thread = threading.Thread(target=run)
        thread.start()
        self.addCleanup(thread.join)
        stream = wire.Stream(listener.getsockname(), "/me", 5)
        self.addCleanup(stream.close)
        with self.assertRaises(nido.Timeout):
            stream.read(0.05)
        gate.set()
        self.assertEqual(stream.read(5)[2], b"late")


if __name__ == "__main__":
    unittest.main()
