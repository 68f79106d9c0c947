"""A robot: its parts, cameras, touch pads and world."""
import struct
import time
import zlib

from . import text
from .errors import Error, Timeout
from .system import System

PARTS = ("head", "torso", "left_arm", "right_arm", "left_leg", "right_leg")
PADS = ("thumb", "index", "middle", "ring", "little", "palm")


class Robot:
    """robot = nido.Robot("icubSim"); robot.left_arm, robot.head, ... are its parts.

    system: of a System that is open already; otherwise one is opened with the other arguments and closed with the robot.
    """

    def __init__(self, name="icubSim", system=None, **options):
        self.name = name
        self.system = system or System(**options)
        self._owns = system is None
        self._kept = {}
        for part in PARTS:
            setattr(self, part, Part(self, part))

    def _keep(self, key, make):
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def part(self, name):
        """A part by its name."""
        if name not in PARTS:
            raise Error(f"there is no part '{name}': {', '.join(PARTS)}")
        return getattr(self, name)

    def camera(self, name="left"):
        """The camera "left", "right" (the eyes) or "outside"."""
        return self._keep(("camera", name), lambda: Camera(self, name))

    def touch(self, hand="right"):
        """What the pads of a hand feel: {"thumb": (on, N), ...}."""
        port = f"/{self.name}/skin/{hand}_hand:o"
        value = self._keep(port, lambda: self.system.reader(port)).latest().value
        return {name: (bool(on), force) for name, on, force in zip(PADS, value["on"], value["force_n"])}

    def world(self, line):
        """A command of the world port, "mk box ...", and its answer as values."""
        line = line if line.startswith("world") else "world " + line
        answer = self.system.ask(f"/{self.name}/world", line)
        try:
            values = text.parse(answer)
        except Error:
            return answer
        return [one for one in values if not (isinstance(one, text.Word) and one == "ok")]

    def say(self, phrase):
        """Somebody in the room says it to the robot, which hears it through its ears: not over a real microphone."""
        answer = self.system.ask(f"/{self.name}/mic/rpc:i", "say " + phrase)
        if not answer.startswith("ok"):
            raise Error(answer)

    def time_s(self):
        """The robot's time now, s: of the simulation, or of the robot's clock."""
        return self._keep("clock", lambda: self.head.states()).latest().time_s

    def close(self):
        for thing in self._kept.values():
            thing.close()
        self._kept.clear()
        for part in PARTS:
            getattr(self, part).close()
        if self._owns:
            self.system.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Joint:
    """name; min_deg and max_deg: its limits; max_speed_deg_s; max_torque_Nm."""

    def __init__(self, name, min_deg, max_deg, max_speed_deg_s, max_torque_Nm):
        self.name, self.min_deg, self.max_deg = name, min_deg, max_deg
        self.max_speed_deg_s, self.max_torque_Nm = max_speed_deg_s, max_torque_Nm

    def __repr__(self):
        return f"Joint({self.name!r}, {self.min_deg:.1f} to {self.max_deg:.1f} deg)"


class Part:
    """The joints of one part, in its order from 0. Angles in degrees, speeds in degrees a second, as everywhere that
    people type them. A joint is told by its number or its name."""

    def __init__(self, robot, name):
        self.name = name
        self._system = robot.system
        self._stem = f"/{robot.name}/{name}"
        self._joints = None
        self._states = None

    def ask(self, line):
        """A line of the control board's vocabulary (docs/control_board.md), and its answer."""
        return self._system.ask(f"{self._stem}/rpc:i", line)

    def _get(self, line):
        values = text.parse(self.ask("get " + line))
        lists = [one for one in values if isinstance(one, list)]
        if not lists:
            raise Error(f"{self._stem}/rpc:i: no values in the answer to 'get {line}'")
        return lists[0]

    @property
    def joints(self):
        """All joints, with their limits."""
        if self._joints is None:
            self._joints = [Joint(str(one[0]), *one[1:5]) for one in self._get("info")]
        return list(self._joints)

    def _number(self, joint):
        names = [one.name for one in self.joints]
        if isinstance(joint, str):
            if joint not in names:
                raise Error(f"{self.name} has no joint '{joint}': {', '.join(names)}")
            return names.index(joint)
        if not 0 <= joint < len(names):
            raise Error(f"{self.name} has no joint {joint}: 0 to {len(names) - 1}")
        return int(joint)

    def _numbers(self, degrees):
        values = [float(one) for one in degrees]
        if len(values) != len(self.joints):
            raise Error(f"{self.name} has {len(self.joints)} joints, not {len(values)}")
        return " ".join(text.dump(one) for one in values)

    def positions(self):
        """All angles now."""
        return [float(one) for one in self._get("encs")]

    def velocities(self):
        return [float(one) for one in self._get("esps")]

    def torques(self):
        """N m."""
        return [float(one) for one in self._get("torq trqs")]

    def set_positions(self, degrees, wait_s=None):
        """Begins a smooth motion of all joints to these angles; with wait_s, waits until it has ended."""
        self.ask(f"set poss ({self._numbers(degrees)})")
        if wait_s is not None:
            self.wait(wait_s)

    def set_position(self, joint, degrees, wait_s=None):
        """The same of one joint."""
        number = self._number(joint)
        self.ask(f"set pos {number} {text.dump(float(degrees))}")
        if wait_s is not None:
            self._wait(f"get don {number}", wait_s)

    def set_speeds(self, degrees_s):
        """Speed of these motions: one number for all joints, or one for each."""
        if isinstance(degrees_s, (int, float)):
            degrees_s = [degrees_s] * len(self.joints)
        self.ask(f"set vels ({self._numbers(degrees_s)})")

    def wait(self, timeout_s=20.0):
        """Until the motion has ended; Timeout after this wall time."""
        self._wait("get dons", timeout_s)

    def _wait(self, question, timeout_s):
        until = time.monotonic() + timeout_s
        while True:
            answer = text.parse(self.ask(question))
            if len(answer) > 2 and answer[2] == 1:
                return
            if time.monotonic() > until:
                raise Timeout(f"{self.name} still moves after {timeout_s} s")
            time.sleep(0.01)

    def stop(self):
        """Stops where it is."""
        self.ask("set stos")

    def command(self, mode, values):
        """One piece of a stream for all joints: "direct" (degrees), "velocity" (degrees/s) or "torque" (N m). A joint stops
        when nothing has come for 65 ms, so say it again, faster than that."""
        heads = {"direct": "dpos", "velocity": "vmos", "torque": "dtqs"}
        if mode not in heads:
            raise Error(f"there is no mode '{mode}': {', '.join(heads)}")
        self._system._say(f"{self._stem}/command:i", f"([{heads[mode]}]) ({self._numbers(values)})",
                          self._system.timeout_s, wants_answer=False)

    def states(self):
        """A reader of /PART/state:o: its messages' values are the angles in degrees, 100 a second of the robot's time."""
        return self._system.reader(f"{self._stem}/state:o")

    def read(self):
        """The newest message of states()."""
        if self._states is None:
            self._states = self.states()
        return self._states.latest()

    def close(self):
        if self._states is not None:
            self._states.close()
            self._states = None


class Image:
    """A picture: height rows of width pixels of 3 bytes, red, green, blue, from the top left. time_s: the robot's."""

    def __init__(self, width, height, data, time_s):
        self.width, self.height, self.data, self.time_s = width, height, data, time_s

    def pixel(self, x, y):
        at = 3 * (y * self.width + x)
        return tuple(self.data[at:at + 3])

    def array(self):
        """As a numpy array of shape (height, width, 3)."""
        import numpy
        return numpy.frombuffer(self.data, numpy.uint8).reshape(self.height, self.width, 3)

    def __array__(self, dtype=None, copy=None):
        array = self.array()
        return array if dtype is None else array.astype(dtype)

    def save(self, path):
        """Writes a PNG file."""
        rows = b"".join(b"\0" + self.data[3 * self.width * y:3 * self.width * (y + 1)] for y in range(self.height))

        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        with open(path, "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", self.width, self.height, 8, 2, 0, 0, 0)) +
                       chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b""))

    def __repr__(self):
        return f"Image({self.width}x{self.height} at {self.time_s:.2f} s)"


def _image_of(message):
    content = message.content
    if len(content) < 60:
        raise Error("the message is no picture")
    words = struct.unpack_from("<15i", content)
    pixel, quantum, width, height = words[5].to_bytes(4, "little"), words[10] & 0xffff, words[11], words[12]
    if words[0] != 256 or words[3].to_bytes(4, "little") != b"mat\0" or pixel != b"rgb\0":
        raise Error("the message is no picture of colours red, green, blue")
    row = 3 * width
    step = -(-row // quantum) * quantum if quantum > 0 else row
    if width < 0 or height < 0 or len(content) - 60 < step * height:
        raise Error("the picture's size does not fit its bytes")
    data = content[60:60 + step * height]
    if step != row:
        data = b"".join(data[step * y:step * y + row] for y in range(height))
    return Image(width, height, data, message.time_s)


class Camera:
    """Pictures of one camera; it works only while somebody reads."""

    def __init__(self, robot, name):
        self.name = name
        self._reader = None
        self._open = lambda: robot.system.reader(f"/{robot.name}/cam/{name}/image:o")

    def read(self, timeout_s=None):
        """The newest picture; waits for one that was not read yet."""
        if self._reader is None:
            self._reader = self._open()
        return _image_of(self._reader.latest(timeout_s))

    def __iter__(self):
        while True:
            yield self.read()

    def close(self):
        if self._reader is not None:
            self._reader.close()
            self._reader = None
