"""Connections to ports, as YARP 3 speaks on them: text to ask and write, binary (fast_tcp) to read."""
import socket
import struct
import time

from . import text
from .errors import Error, NotFound, Timeout

_FAST_TCP = b"YA" + struct.pack("<i", 7777 + 3) + b"RP"
_INDEX = b"YA" + struct.pack("<i", 10) + b"RP"
_MOST_BYTES = 64 << 20
_LIST, _INT8, _INT16, _INT32, _INT64, _VOCAB, _STRING, _BLOB, _FLOAT32, _FLOAT64 = 256, 32, 64, 1, 17, 9, 4, 12, 128, 10
_DICT = 512
_NUMBERS = {_INT8: "b", _INT16: "h", _INT32: "i", _INT64: "q", _FLOAT32: "f", _FLOAT64: "d"}


def ask_names(address, command, timeout_s=5.0):
    """Lines that the name server answers."""
    try:
        with socket.create_connection(address, timeout_s) as server:
            server.sendall(f"NAME_SERVER {command}\n".encode())
            file = server.makefile(encoding="utf-8", errors="replace")
            lines = []
            for line in file:
                if line.startswith("*** end"):
                    return lines
                lines.append(line.strip())
            return lines
    except socket.timeout:
        raise Timeout(f"the names on {address[0]}:{address[1]} do not answer") from None
    except OSError as error:
        raise NotFound(f"nobody serves names on {address[0]}:{address[1]} ({error}): is nido-gateway running?") from None


def find_port(address, name):
    """Host and TCP port of a port, or None."""
    for line in ask_names(address, f"query {name}"):
        words = line.split()
        if words[:1] == ["registration"] and "ip" in words and "port" in words:
            return words[words.index("ip") + 1], int(words[words.index("port") + 1])
    return None


class TextConnection:
    """Asks, and writes, a line at a time."""

    def __init__(self, where, sender, timeout_s):
        self._socket = socket.create_connection(where, timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._file = self._socket.makefile("rb")
        self._socket.sendall(f"CONNECT {sender}\n".encode())
        self._line()

    def ask(self, line, timeout_s):
        if "\n" in line or "\r" in line:
            raise Error("a line is expected, without a line break")
        self._socket.settimeout(timeout_s)
        self._socket.sendall(b"d\n" + line.encode() + b"\n")
        return self._line()

    def tell(self, line):
        """Sends without waiting for an answer."""
        self._socket.sendall(b"D\n" + line.encode() + b"\n")

    def _line(self):
        try:
            line = self._file.readline()
        except socket.timeout:
            raise Timeout("no answer in time") from None
        if not line.endswith(b"\n"):
            raise NotFound("the port closed the connection")
        return line.decode("utf-8", "replace").rstrip("\r\n")

    def close(self):
        self._file.close()
        self._socket.close()


class Stream:
    """Takes what an output sends."""

    def __init__(self, where, sender, timeout_s):
        self._socket = socket.create_connection(where, timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._bytes = bytearray()
        name = sender.encode() + b"\0"
        self._socket.sendall(_FAST_TCP + struct.pack("<i", len(name)) + name)
        self._take(8, time.monotonic() + timeout_s)  # it says its port, which does not matter
        # from now on the far side sends: an empty message with the command 'r'
        self._socket.sendall(_message(b"r"))

    def read(self, timeout_s):
        """(count, seconds, content) of the next message; content: its bytes."""
        until = time.monotonic() + timeout_s
        # an interrupted wait must not eat half a message: everything is looked at before it is taken
        at = 18
        head = self._peek(at, until)
        if head[:8] != _INDEX:
            raise Error("the far side does not speak YARP's protocol")
        blocks, outputs = head[8], head[9]
        head = self._peek(at + 4 * (blocks + outputs), until)
        size = sum(struct.unpack_from(f"<{blocks}i", head, at))
        at += 4 * (blocks + outputs)
        if size > _MOST_BYTES:
            raise Error(f"a message of {size} bytes is too large")
        self._peek(at + size, until)
        message = bytes(memoryview(self._bytes)[at:at + size])
        del self._bytes[:at + size]
        length, command = struct.unpack_from("<ixB", message)
        if command:
            return 0, 0.0, message[8:]
        words = message[8:8 + length].rstrip(b"\0").decode("ascii", "replace").split()
        count, seconds = (int(words[1]), float(words[2])) if len(words) > 2 else (0, 0.0)
        return count, seconds, message[8 + length:]

    def waiting(self):
        """Is a message here already?"""
        try:
            self._socket.settimeout(0)
            self._receive()
        except (BlockingIOError, socket.timeout):
            pass
        return self._whole() is not None

    def _whole(self):
        if len(self._bytes) < 18:
            return None
        blocks, outputs = self._bytes[8], self._bytes[9]
        at = 18 + 4 * (blocks + outputs)
        if len(self._bytes) < at:
            return None
        size = sum(struct.unpack_from(f"<{blocks}i", self._bytes, 18))
        return at + size if len(self._bytes) >= at + size else None

    def _receive(self):
        try:
            piece = self._socket.recv(1 << 18)
        except ConnectionError:  # closed with something of ours unread
            piece = b""
        if not piece:
            raise NotFound("the port closed the connection")
        self._bytes += piece

    def _peek(self, size, until):
        while len(self._bytes) < size:
            left = until - time.monotonic()
            if left <= 0:
                raise Timeout("no message in time")
            self._socket.settimeout(left)
            try:
                self._receive()
            except socket.timeout:
                raise Timeout("no message in time") from None
        return self._bytes

    def _take(self, size, until):
        self._peek(size, until)
        del self._bytes[:size]

    def close(self):
        self._socket.close()


def _message(command):
    return _INDEX + bytes([1, 1] + [255] * 8) + struct.pack("<ii", 8, 0) + struct.pack("<i", 0) + b"~" + command + b"\0\1"


def decode(content):
    """The values of a binary Bottle, as a list."""
    code, at = _unpack("<i", content, 0)
    if code & _DICT:
        code, at = _unpack("<i", content, at)
    values, _ = _list(content, at, code & ~_LIST & ~_DICT, 0)
    return values


def _unpack(form, content, at):
    try:
        return struct.unpack_from(form, content, at)[0], at + struct.calcsize(form)
    except struct.error:
        raise Error("a message ends too early") from None


def _list(content, at, code, depth):
    if depth > 32:
        raise Error("lists are nested too deep")
    count, at = _unpack("<i", content, at)
    if count < 0 or count > len(content):
        raise Error(f"a list of {count} values")
    if code in _NUMBERS:
        try:
            values = list(struct.unpack_from(f"<{count}{_NUMBERS[code]}", content, at))
        except struct.error:
            raise Error("a message ends too early") from None
        return values, at + struct.calcsize(f"<{count}{_NUMBERS[code]}")
    values = []
    for _ in range(count):
        one = code
        if not code:
            one, at = _unpack("<i", content, at)
        value, at = _value(content, at, one, depth)
        values.append(value)
    return values, at


def _value(content, at, code, depth):
    if code in _NUMBERS:
        return _unpack("<" + _NUMBERS[code], content, at)
    if code & _DICT:
        inner, at = _unpack("<i", content, at)
        return _list(content, at, inner & ~_LIST & ~_DICT, depth + 1)
    if code & _LIST:
        return _list(content, at, code & ~_LIST, depth + 1)
    if code == _VOCAB:
        word = content[at:at + 4].rstrip(b"\0").decode("ascii", "replace")
        # true and false travel as the words "1" and ""
        return ({"1": True, "": False}.get(word, text.Word(word))), at + 4
    if code in (_STRING, _BLOB):
        size, at = _unpack("<i", content, at)
        if size < 0 or at + size > len(content):
            raise Error("a message ends too early")
        raw = content[at:at + size]
        return (raw if code == _BLOB else raw.decode("utf-8", "replace")), at + size
    raise Error(f"values of code {code} are not known")
