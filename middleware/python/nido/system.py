"""A running nido system, seen through its gateway (docs/python.md)."""
import atexit
import os
import random
import shutil
import socket
import subprocess
import threading
import time

from . import text, wire
from .errors import Error, NotFound, Refused, Timeout

# the program goes with this process, however that ends: its standard input is a pipe from here
_KEEPER = '"$@" </dev/null & child=$!; read -r line; kill "$child" 2>/dev/null; wait "$child"'


def _find_gateway():
    here = os.path.dirname(os.path.abspath(__file__))
    places = [os.environ.get("NIDO_GATEWAY", "")]
    # an installation: PREFIX/lib/python3/dist-packages/nido and PREFIX/bin; a source tree: middleware/python/nido and build/bin
    for steps in (4, 3):
        root = os.path.abspath(os.path.join(here, *[".."] * steps))
        places += [os.path.join(root, "bin", "nido-gateway"), os.path.join(root, "build", "bin", "nido-gateway")]
    places.append(shutil.which("nido-gateway") or "")
    for place in places:
        if place and os.access(place, os.X_OK):
            return place
    raise NotFound("nido-gateway is not there: build or install nido, or say where it is with NIDO_GATEWAY=/path/nido-gateway")


def _two_free_ports():
    # the ports of a gateway are counted up from its names' port: low enough to meet no short-lived connection
    for _ in range(200):
        port = random.randrange(12000, 30000, 2)
        try:
            with socket.socket() as one, socket.socket() as two:
                one.bind(("127.0.0.1", port))
                two.bind(("127.0.0.1", port + 2))
                return port
        except OSError:
            continue
    raise Error("no free ports were found")


class System:
    """The ports of one DDS domain.

    domain: 0 to 101; by default NIDO_DOMAIN, ROS_DOMAIN_ID, or 0. A gateway is started for it, which ends with this
    object. names_port: of a gateway that runs already (10000 unless it was told otherwise); none is started then.
    """

    def __init__(self, domain=None, names_port=None, timeout_s=10.0):
        self.timeout_s = timeout_s
        self._keeper = None
        self._settled_at = 0.0
        self._asking = {}
        self._lock = threading.Lock()
        self._name = f"/python/{os.getpid()}/{id(self):x}"
        if names_port is None:
            if domain is None:
                domain = int(os.environ.get("NIDO_DOMAIN") or os.environ.get("ROS_DOMAIN_ID") or 0)
            if not 0 <= domain <= 101:
                raise Error(f"domain is {domain}: 0 to 101")
            names_port = _two_free_ports()
            self._start(domain, names_port)
        self._names = ("127.0.0.1", names_port)
        if self._keeper is not None:
            self._await_names()

    def _start(self, domain, names_port):
        program = _find_gateway()
        command = [program, "--name", f"python_{os.getpid()}_{names_port}", "--domain", str(domain),
                   "--set", f"names_port={names_port}", "--set", "names=serve"]
        self._keeper = subprocess.Popen(["/bin/sh", "-c", _KEEPER, "sh"] + command, stdin=subprocess.PIPE,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        atexit.register(self.close)

    def _await_names(self):
        until = time.monotonic() + max(self.timeout_s, 10.0)
        while True:
            try:
                wire.ask_names(self._names, "check /none none")
                self._settled_at = time.monotonic() + 1.5
                return
            except Error as error:
                if time.monotonic() > until:
                    self.close()
                    raise NotFound(f"nido-gateway did not start: {error}") from None
                time.sleep(0.05)

    def close(self):
        """Ends connections, and the gateway if it was started here."""
        with self._lock:
            for connection in self._asking.values():
                connection.close()
            self._asking.clear()
        keeper, self._keeper = self._keeper, None
        if keeper is not None:
            atexit.unregister(self.close)
            keeper.stdin.close()
            try:
                keeper.wait(5)
            except subprocess.TimeoutExpired:
                keeper.kill()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def ports(self, prefix="/"):
        """Names of all ports, sorted."""
        # a gateway that has just come finds them one after another
        time.sleep(max(0.0, self._settled_at - time.monotonic()))
        names = [line.split()[2] for line in wire.ask_names(self._names, "list") if line.startswith("registration name")]
        own = ("/root", "fallback", "/python/")
        return sorted(name for name in set(names) if name.startswith(prefix) and not name.startswith(own))

    def wait_for(self, port, timeout_s=None):
        """Waits until a port is there."""
        return self._where(port, timeout_s)

    def _where(self, port, timeout_s=None):
        limit_s = self.timeout_s if timeout_s is None else timeout_s
        until = time.monotonic() + limit_s
        while True:
            where = wire.find_port(self._names, port)
            if where is not None:
                return where
            if time.monotonic() > until:
                near = [name for name in self.ports() if name.split("/")[-1] == port.split("/")[-1]][:3]
                raise NotFound(f"there is no port {port}" + (f"; there are {', '.join(near)}" if near else
                                                            ": is the system running, in this domain?"))
            time.sleep(0.05)

    def _say(self, port, line, timeout_s, wants_answer=True):
        with self._lock:
            connection = self._asking.get(port)
            if connection is None:
                connection = self._asking[port] = wire.TextConnection(self._where(port, timeout_s), self._name, timeout_s)
            try:
                if wants_answer:
                    return connection.ask(line, timeout_s)
                connection.tell(line)
                return None
            except (Error, OSError) as error:
                # what comes later on this connection would be the answer to another question
                connection.close()
                del self._asking[port]
                if isinstance(error, Error):
                    raise type(error)(f"{port}: {error}") from None
                raise NotFound(f"{port}: {error}") from None

    def ask(self, port, line, timeout_s=None):
        """Asks a service; its answer as text. Refused if that is [fail] or [nak]."""
        answer = self._say(port, line, self.timeout_s if timeout_s is None else timeout_s)
        if answer.startswith(("[fail]", "[nak]")):
            words = [str(one) for one in text.parse(answer)[1:]]
            raise Refused(f"{port}: {': '.join(words) or answer}")
        if answer.startswith('"') and answer.endswith('"'):
            values = text.parse(answer)
            if len(values) == 1:
                return str(values[0])
        return answer

    def write(self, port, message=None, **fields):
        """Sends one message to an input: a dict or keywords of its fields; waits until it was taken.

        write("/icubSim/head/command:i" ...) speaks YARP's form of a board's stream: use Part.command for that.
        """
        content = dict(message or {}, **fields)
        if not content:
            raise Error("a message needs at least one field")
        line = " ".join(f"({key} {text.dump(value)})" for key, value in content.items())
        answer = text.parse(self._say(port, line, self.timeout_s) or "")
        if answer[:1] == ["fail"]:
            raise Refused(f"{port}: {' '.join(str(one) for one in answer[1:])}")

    def reader(self, port, timeout_s=None):
        """A Reader of an output, from now on."""
        return Reader(self, port, self.timeout_s if timeout_s is None else timeout_s)

    def read(self, port, timeout_s=None):
        """The next message of an output. For more than one, a reader is quicker."""
        with self.reader(port, timeout_s) as reader:
            return reader.read()


class Message:
    """What an output sent. value: a dict of its fields, or a list of numbers where YARP has a vector. count: its
    number. time_s: the robot's time of it."""

    def __init__(self, count, time_s, content):
        self.count = count
        self.time_s = time_s
        self.content = content

    @property
    def value(self):
        return text.named(wire.decode(self.content))

    def __repr__(self):
        return f"Message(count={self.count}, time_s={self.time_s}, value={self.value!r})"


class Reader:
    """Messages of an output, in order. Iterate over it, or read() one."""

    def __init__(self, system, port, timeout_s):
        self.port = port
        self.timeout_s = timeout_s
        self._stream = wire.Stream(system._where(port, timeout_s), f"{system._name}{port}", timeout_s)

    def read(self, timeout_s=None):
        try:
            return Message(*self._stream.read(self.timeout_s if timeout_s is None else timeout_s))
        except Timeout:
            raise Timeout(f"{self.port} sent nothing in time") from None
        except OSError as error:
            raise NotFound(f"{self.port}: {error}") from None

    def latest(self, timeout_s=None):
        """The newest message: older ones that wait are passed over."""
        message = self.read(timeout_s)
        while self._stream.waiting():
            message = self.read(timeout_s)
        return message

    def __iter__(self):
        while True:
            yield self.read()

    def close(self):
        self._stream.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
