#!/usr/bin/env python3
"""Writes icub.urdf, the one description of the body that every part of the project reads.

    python3 config/robots/generate_urdf.py            # writes icub.urdf and meshes/ beside this file
    python3 config/robots/generate_urdf.py --check    # fails if they are not what would be written

Joint geometry, names and limits come from icub_geometry.json (Denavit-Hartenberg chains). Shapes, masses, torques and
reference speeds are round figures of this file. docs/body.md explains the <nido> block at the end of the URDF.
Needs nothing but Python's standard library.
"""
import json
import math
import pathlib
import sys
from xml.sax.saxutils import quoteattr

sys.dont_write_bytecode = True
import icub_looks  # noqa: E402
import icub_skin  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
TOTAL_MASS_KG = 20.3
FINGER_LINK_MASS_KG = 0.008
FINGER_RADIUS_M = 0.0065

WHITE, GREY, DARK = "white", "grey", "dark"
COLOURS = {
    WHITE: (0.90, 0.90, 0.92, 1), GREY: (0.42, 0.43, 0.45, 1), DARK: (0.10, 0.10, 0.11, 1), "hand": (0.50, 0.50, 0.52, 1),
    "eye": (0.97, 0.97, 0.97, 1), "lips": (0.75, 0.10, 0.10, 1), "magenta": (1.0, 0.0, 1.0, 1), "cyan": (0.0, 1.0, 1.0, 1),
    **icub_looks.COLOURS,
}
IDENTITY = [[float(i == j) for j in range(4)] for i in range(4)]


# ---------------------------------------------------------------------------------------------- rigid transforms
def mul(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def inverse(a):
    r = [[a[j][i] for j in range(3)] for i in range(3)]
    t = [-sum(r[i][k] * a[k][3] for k in range(3)) for i in range(3)]
    return [r[0] + [t[0]], r[1] + [t[1]], r[2] + [t[2]], [0.0, 0.0, 0.0, 1.0]]


def translation(x, y, z):
    return [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]]


def cos_sin_deg(angle):
    """Exact at multiples of 90 degrees, so that right angles stay right angles in the URDF."""
    quarter = angle / 90.0
    if quarter == round(quarter):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(round(quarter)) % 4]
    return math.cos(math.radians(angle)), math.sin(math.radians(angle))


def rot(axis, deg):
    c, s = cos_sin_deg(deg)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    m = [row[:] for row in IDENTITY]
    m[i][i], m[i][j], m[j][i], m[j][j] = c, -s, s, c
    return m


def orthonormal(m):
    """The rotation nearest to a matrix that was printed with few digits (iterated polar decomposition)."""
    r = [row[:3] for row in m[:3]]
    for _ in range(30):
        det = (r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0])
               + r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]))
        inv_t = [[(r[(i + 1) % 3][(j + 1) % 3] * r[(i + 2) % 3][(j + 2) % 3]
                   - r[(i + 1) % 3][(j + 2) % 3] * r[(i + 2) % 3][(j + 1) % 3]) / det for j in range(3)] for i in range(3)]
        r = [[0.5 * (r[i][j] + inv_t[i][j]) for j in range(3)] for i in range(3)]
    return [[r[i][0], r[i][1], r[i][2], float(m[i][3])] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def rpy(m):
    """URDF's roll, pitch, yaw (R = Rz Ry Rx). At pitch +-90 degrees, roll and yaw are one turn: yaw is 0 then."""
    horizontal = math.hypot(m[0][0], m[1][0])
    pitch = math.atan2(-m[2][0], horizontal)
    if horizontal < 1e-9:
        return (math.atan2(m[0][1], m[1][1]) * (1 if pitch > 0 else -1), math.copysign(math.pi / 2, pitch), 0.0)
    return math.atan2(m[2][1], m[2][2]), pitch, math.atan2(m[1][0], m[0][0])


def along(p, q):
    """A frame at the middle of p and q whose z axis points from p to q, and the distance."""
    d = [q[i] - p[i] for i in range(3)]
    length = math.sqrt(sum(v * v for v in d))
    z = [v / length for v in d]
    helper = [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0]
    y = [z[1] * helper[2] - z[2] * helper[1], z[2] * helper[0] - z[0] * helper[2], z[0] * helper[1] - z[1] * helper[0]]
    n = math.sqrt(sum(v * v for v in y))
    y = [v / n for v in y]
    x = [y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]]
    mid = [(p[i] + q[i]) / 2 for i in range(3)]
    return [[x[i], y[i], z[i], mid[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]], length


# ---------------------------------------------------------------------------------------------- shapes
class Shape:
    """A solid in its link's frame. kind: box (x, y, z), sphere (r), cylinder or capsule (r, length along z); or a mesh
    (scale; its name is the file), which is only to be seen."""

    def __init__(self, kind, size, pose, colour, visual=True, collision=True, name=""):
        self.kind, self.size, self.pose, self.colour = kind, size, pose, colour
        self.visual, self.collision, self.name = visual, collision, name

    def volume(self):
        s = self.size
        if self.kind == "mesh":
            return 0.0
        if self.kind == "box":
            return s[0] * s[1] * s[2]
        ball = 4 / 3 * math.pi * s[0] ** 3
        if self.kind == "sphere":
            return ball
        return math.pi * s[0] ** 2 * s[1] + (ball if self.kind == "capsule" else 0)

    def inertia(self, m):
        """Principal moments about the shape's own axes; a capsule counts as a cylinder of its whole length."""
        s = self.size
        if self.kind == "mesh":
            return [0.0] * 3
        if self.kind == "box":
            return [m / 12 * (s[1] ** 2 + s[2] ** 2), m / 12 * (s[0] ** 2 + s[2] ** 2), m / 12 * (s[0] ** 2 + s[1] ** 2)]
        if self.kind == "sphere":
            return [0.4 * m * s[0] ** 2] * 3
        length = s[1] + (2 * s[0] * 2 / 3 if self.kind == "capsule" else 0)
        across = m / 12 * (3 * s[0] ** 2 + length ** 2)
        return [across, across, m / 2 * s[0] ** 2]


def segment(p, q, radius, colour, kind="capsule", **more):
    pose, length = along(p, q)
    return Shape(kind, (radius, length), pose, colour, **more)


def box(x, y, z, centre, colour, **more):
    return Shape("box", (x, y, z), translation(*centre), colour, **more)


def sphere(r, centre, colour, **more):
    return Shape("sphere", (r,), translation(*centre), colour, **more)


def mesh(path, scale, colour, name):
    shape = Shape("mesh", scale, IDENTITY, colour, collision=False, name=name)
    shape.path = path
    return shape


# ---------------------------------------------------------------------------------------------- the robot
class Link:
    def __init__(self, name, mass=0.0):
        self.name, self.mass, self.shapes = name, mass, []


class Joint:
    def __init__(self, name, parent, child, origin, kind="revolute"):
        self.name, self.parent, self.child, self.origin, self.kind = name, parent, child, origin, kind
        self.lower = self.upper = self.velocity = self.effort = 0.0
        self.mimic = ""


class Robot:
    def __init__(self, geometry):
        self.geometry = geometry
        self.links = {"root_link": Link("root_link", 2.6)}
        self.joints = {}
        self.at_zero = {"root_link": IDENTITY}  # pose of every link in the root frame with all joints at 0

    def add(self, joint, mass=0.0):
        if joint.name in self.joints:
            return
        self.joints[joint.name] = joint
        self.links[joint.child] = Link(joint.child, mass)
        self.at_zero[joint.child] = mul(self.at_zero[joint.parent], joint.origin)

    def add_chain(self, chain, base, link_of, tip, mass_of):
        """Adds a DH chain. A link's frame is the DH frame before its joint's constant part, turned by the joint angle,
        so that chains that share joints share links. `tip` is the frame at the chain's end."""
        data = self.geometry["chains"][chain]
        pending = orthonormal(data["H0"])
        parent = base
        for name, a, d, alpha, offset in data["links"]:
            if name:
                joint, child = link_of(name)
                self.add(Joint(joint, parent, child, pending), mass_of(child))
                parent, pending = child, IDENTITY
            constant = mul(rot("z", offset), mul(translation(0, 0, d), mul(translation(a, 0, 0), rot("x", alpha))))
            pending = mul(pending, constant)
        self.add(Joint(tip + "_fixed", parent, tip, mul(pending, orthonormal(data["HN"])), "fixed"))

    def dress(self, link, *shapes_in_root):
        """Shapes given in the root frame at zero angles, where a body is easiest to think of."""
        to_link = inverse(self.at_zero[link])
        for shape in shapes_in_root:
            shape.pose = mul(to_link, shape.pose)
            self.links[link].shapes.append(shape)


BODY_MASS_KG = {  # before scaling to the total
    "torso_1": 0.75, "torso_2": 0.75, "chest": 4.4, "neck_1": 0.25, "neck_2": 0.12, "head": 1.2, "eyes": 0.08,
    "eye_ball": 0.025, "shoulder_1": 0.36, "shoulder_2": 0.17, "upper_arm": 0.85, "elbow_1": 0.25, "forearm": 0.25,
    "wrist_1": 0.05, "palm": 0.18, "hip_1": 0.40, "hip_2": 0.55, "thigh": 1.75, "shank": 0.95, "ankle_1": 0.35, "ankle_2": 0.30,
}
JOINT_LINK = {
    "torso_pitch": "torso_1", "torso_roll": "torso_2", "torso_yaw": "chest", "neck_pitch": "neck_1", "neck_roll": "neck_2",
    "neck_yaw": "head", "eyes_tilt": "eyes", "right_eye_pan": "right_eye_ball", "left_eye_pan": "left_eye_ball",
    "shoulder_pitch": "shoulder_1", "shoulder_roll": "shoulder_2", "shoulder_yaw": "upper_arm", "elbow": "elbow_1",
    "wrist_prosup": "forearm", "wrist_pitch": "wrist_1", "wrist_yaw": "palm",
    "hip_pitch": "hip_1", "hip_roll": "hip_2", "hip_yaw": "thigh", "knee": "shank", "ankle_pitch": "ankle_1", "ankle_roll": "ankle_2",
}
FINGERS = ("thumb", "index", "middle", "ring", "little")


def body_mass(link):
    for prefix in ("r_", "l_", "right_", "left_"):
        if link.startswith(prefix):
            link = link[len(prefix):]
    return BODY_MASS_KG[link]


def build(geometry):
    robot = Robot(geometry)

    def link_of(name):
        if name[:2] in ("r_", "l_"):
            return name, name[:2] + JOINT_LINK[name[2:]]
        return name, JOINT_LINK[name]

    for side, s in (("right", "r"), ("left", "l")):
        robot.add_chain(side + "_arm", "root_link", link_of, s + "_hand", body_mass)
        robot.add_chain(side + "_leg", "root_link", link_of, s + "_foot", body_mass)
        robot.add_chain(side + "_eye", "root_link", link_of, s + "_eye", body_mass)
        for finger in FINGERS:
            def finger_link(name, side_letter=s):
                part = {"oppose": "0", "abduction": "0", "proximal": "1", "distal_1": "2", "distal_2": "3"}
                digit, kind = name.split("_", 1)
                return f"{side_letter}_{name}", f"{side_letter}_{digit}_{part[kind]}"
            robot.add_chain(f"{side}_{finger}", s + "_hand", finger_link, f"{s}_{finger}_tip", lambda _: FINGER_LINK_MASS_KG)

    # frames of the head whose chains end before the eyes turn
    for chain, last, tip in (("head_center", "neck_yaw", "head_center"), ("inertial", "neck_yaw", "imu")):
        data = geometry["chains"][chain]
        pose, past = IDENTITY, False
        for name, a, d, alpha, offset in data["links"]:
            past = past or name == last
            if past:
                pose = mul(pose, mul(rot("z", offset), mul(translation(0, 0, d), mul(translation(a, 0, 0), rot("x", alpha)))))
        robot.add(Joint(tip + "_fixed", "head", tip, mul(pose, orthonormal(data["HN"])), "fixed"))

    add_marks(robot)
    dress_body(robot)
    robot.mesh_files = icub_looks.dress(robot, mesh)
    scale_masses(robot)
    return robot


MARK_X_M = {"knuckle": 0.002, "wrist": -0.044}
MARK_RADIUS_M, MARK_THICKNESS_M = 0.008, 0.001
PALM_SIZE_M, PALM_CENTRE_M = (0.065, 0.070, 0.022), (-0.022, 0.0, -0.012)  # right palm frame


def add_marks(robot):
    """Frames of the marks: origin at the middle of the disc's outer face, z out of the back of the hand, x to the fingers."""
    for s, out in (("r", -1), ("l", 1)):
        back = out * (-PALM_CENTRE_M[2] + PALM_SIZE_M[2] / 2 + MARK_THICKNESS_M)
        turn = rot("x", 180) if out < 0 else IDENTITY
        for mark, colour in (("knuckle", "magenta"), ("wrist", "cyan")):
            name = f"{s}_hand_mark_{mark}"
            robot.add(Joint(name + "_fixed", s + "_hand", name, mul(translation(MARK_X_M[mark], 0, back), turn), "fixed"))
            robot.links[name].shapes.append(Shape("cylinder", (MARK_RADIUS_M, MARK_THICKNESS_M),
                                                  translation(0, 0, -MARK_THICKNESS_M / 2), colour, collision=False, name=name))


CHEST_SIZE_M, CHEST_CENTRE_M = (0.105, 0.135, 0.10), (0.012, 0, 0.130)  # root frame at zero angles
SHOULDER_M = (-0.0108, 0.1101, 0.1753)  # the right one


def dress_body(robot):
    robot.dress("root_link", box(0.11, 0.14, 0.09, (0.0, 0.0, -0.075), WHITE))
    robot.dress("torso_1", segment((0, -0.05, 0.0), (0, 0.05, 0.0), 0.034, DARK, "cylinder"))
    robot.dress("torso_2", segment((0, 0, 0.025), (0, 0, 0.075), 0.045, DARK, "cylinder"))
    robot.dress("chest", box(*CHEST_SIZE_M, CHEST_CENTRE_M, WHITE),
                segment((0.005, -0.06, 0.185), (0.005, 0.06, 0.185), 0.036, WHITE, "cylinder"),
                segment((-0.0078, 0, 0.20), (-0.0078, 0, 0.232), 0.026, DARK, "cylinder", collision=False),
                box(0.004, 0.05, 0.03, (-0.0425, 0, 0.140), GREY, collision=False))
    robot.dress("neck_1", segment((-0.0078, 0, 0.236), (-0.0078, 0, 0.262), 0.022, DARK, "cylinder"))
    robot.dress("neck_2", sphere(0.024, (-0.0088, 0, 0.270), DARK))
    face = (0.015, 0.0, 0.3724)
    robot.dress("head", sphere(0.080, face, WHITE),
                segment((0.002, 0, 0.285), (0.002, 0, 0.318), 0.046, WHITE, "cylinder", collision=False),
                segment((face[0], -0.083, face[2] - 0.012), (face[0], 0.083, face[2] - 0.012), 0.024, GREY, "cylinder", collision=False),
                box(0.006, 0.030, 0.006, (-0.043, 0, 0.306), "lips", collision=False))
    robot.dress("eyes", segment((-0.050, -0.028, 0.3408), (-0.050, 0.028, 0.3408), 0.004, DARK, "cylinder", collision=False))
    for s, y in (("right", 1), ("left", -1)):
        eye = (-0.0628, 0.034 * y, 0.3408)
        robot.dress(f"{s}_eye_ball", sphere(0.017, eye, "eye", collision=False),
                    segment((eye[0] - 0.0150, eye[1], eye[2]), (eye[0] - 0.0172, eye[1], eye[2]), 0.0065, DARK, "cylinder", collision=False))
        s = s[0]
        shoulder = (SHOULDER_M[0], SHOULDER_M[1] * y, SHOULDER_M[2])
        axis = (0.0279, -0.1041 * y, 0.0)  # along the shoulder pitch axis, to the chest
        robot.dress(f"{s}_shoulder_1", segment(tuple(shoulder[i] + 0.40 * axis[i] for i in range(3)),
                                               tuple(shoulder[i] + 0.08 * axis[i] for i in range(3)), 0.030, GREY, "cylinder"))
        robot.dress(f"{s}_shoulder_2", sphere(0.036, shoulder, WHITE))
        x, yy = shoulder[0], shoulder[1]
        robot.dress(f"{s}_upper_arm", segment((x, yy, 0.140), (x, yy, 0.055), 0.028, WHITE, name="capsule"))
        robot.dress(f"{s}_elbow_1", segment((x, yy, 0.023), (x, yy, -0.030), 0.026, GREY, name="capsule"))
        robot.dress(f"{s}_forearm", segment((x, yy, -0.050), (x, yy, -0.085), 0.024, WHITE, name="capsule"))
        robot.dress(f"{s}_wrist_1", sphere(0.017, (x, yy, -0.1143), GREY))
        robot.dress(f"{s}_hip_1", segment((0.035, 0.0681 * y, -0.1199), (-0.035, 0.0681 * y, -0.1199), 0.030, GREY, "cylinder"))
        robot.dress(f"{s}_hip_2", sphere(0.038, (0, 0.0681 * y, -0.1199), GREY))
        robot.dress(f"{s}_thigh", segment((0, 0.0681 * y, -0.190), (0, 0.0681 * y, -0.295), 0.042, WHITE, name="capsule"))
        robot.dress(f"{s}_shank", segment((0, 0.0681 * y, -0.375), (0, 0.0681 * y, -0.500), 0.034, WHITE, name="capsule"))
        robot.dress(f"{s}_ankle_1", sphere(0.027, (0, 0.0681 * y, -0.5565), GREY))
        robot.dress(f"{s}_ankle_2", box(0.145, 0.062, 0.024, (-0.028, 0.0681 * y, -0.5855), WHITE))
        dress_hand(robot, s)


def dress_hand(robot, s):
    palm_pose = mul(inverse(robot.at_zero[f"{s}_palm"]), robot.at_zero[f"{s}_hand"])
    centre = (PALM_CENTRE_M[0], PALM_CENTRE_M[1], PALM_CENTRE_M[2] if s == "r" else -PALM_CENTRE_M[2])
    robot.links[f"{s}_palm"].shapes.append(Shape("box", PALM_SIZE_M, mul(palm_pose, translation(*centre)), "hand"))
    ends = {}  # link -> where its bone ends, in the link's frame
    for joint in robot.joints.values():
        ends[joint.parent] = [joint.origin[i][3] for i in range(3)]
    for finger in FINGERS:
        for number in "0123":
            link = f"{s}_{finger}_{number}"
            if link not in robot.links:
                continue
            end = ends[link]
            length = math.sqrt(sum(v * v for v in end))
            if number == "3":  # the cap ends at the finger tip frame
                end = [v * (length - FINGER_RADIUS_M) / length for v in end]
            robot.links[link].shapes.append(segment((0, 0, 0), end, FINGER_RADIUS_M, "hand", name="capsule"))


def scale_masses(robot):
    fingers = sum(l.mass for l in robot.links.values() if l.mass == FINGER_LINK_MASS_KG)
    rest = sum(l.mass for l in robot.links.values()) - fingers
    for link in robot.links.values():
        if link.mass != FINGER_LINK_MASS_KG:
            link.mass = round(link.mass * (TOTAL_MASS_KG - fingers) / rest, 6)


# ---------------------------------------------------------------------------------------------- axes and coupling
# part of a name -> (torque N m, reference speed deg/s)
DRIVES = (
    ("torso", 36, 15), ("neck", 8, 30), ("eyes", 1, 60), ("shoulder_pitch", 40, 25), ("shoulder_roll", 40, 25), ("shoulder_yaw", 20, 25),
    ("elbow", 20, 25), ("wrist_prosup", 5, 30), ("wrist", 3, 30), ("hand_finger", 0.3, 30), ("thumb_oppose", 0.4, 60),
    ("thumb_proximal", 0.3, 60), ("thumb_distal", 0.2, 90), ("proximal", 0.3, 60), ("distal", 0.2, 90), ("pinky", 0.25, 120),
    ("hip", 60, 20), ("knee", 50, 20), ("ankle", 40, 20),
)
VELOCITY_DEG_S = 100.0
HOME_DEG = {
    "shoulder_pitch": -25, "shoulder_roll": 20, "elbow": 50, "hand_finger": 59, "thumb_oppose": 20, "thumb_proximal": 20, "thumb_distal": 20,
    "index_proximal": 10, "index_distal": 10, "middle_proximal": 10, "middle_distal": 10, "pinky": 10,
}


def drive(name):
    for part, effort, speed in DRIVES:
        if part in name:
            return effort, speed
    raise ValueError(f"no drive for joint {name}")


def coupling(axis):
    """The hinges that an axis moves: (joint, multiplier, offset in degrees). A hinge's angle is the sum over its axes."""
    s = axis[:2]
    kind = axis[2:] if s in ("r_", "l_") else axis
    if kind == "eyes_version":
        return [("left_eye_pan", 1.0, 0.0), ("right_eye_pan", 1.0, 0.0)]
    if kind == "eyes_vergence":
        return [("left_eye_pan", 0.5, 0.0), ("right_eye_pan", -0.5, 0.0)]
    if kind == "hand_finger":
        return [(f"{s}{f}_abduction", -1 / 3, 20.0) for f in ("index", "ring", "little")]
    if kind in ("thumb_distal", "index_distal", "middle_distal"):
        return [(f"{s}{kind}_{i}", 0.5, 0.0) for i in (1, 2)]
    if kind == "pinky":
        return [(f"{s}{f}_{j}", 1 / 3, 0.0) for f in ("ring", "little") for j in ("proximal", "distal_1", "distal_2")]
    return [(axis, 1.0, 0.0)]


def set_limits(robot):
    spans = {}
    for part in robot.geometry["parts"]:
        for name, lower, upper in part["joints"]:
            hinges = coupling(name)
            for joint, multiplier, offset in hinges:
                ends = sorted((lower * multiplier, upper * multiplier))
                span = spans.setdefault(joint, [0.0, 0.0])
                span[0] += ends[0] + offset
                span[1] += ends[1] + offset
                robot.joints[joint].effort = drive(name)[0]
                robot.joints[joint].velocity = math.radians(VELOCITY_DEG_S)
            if len(hinges) > 1 and not name.startswith("eyes"):
                for joint, _, _ in hinges[1:]:
                    robot.joints[joint].mimic = hinges[0][0]
    for name, (lower, upper) in spans.items():
        robot.joints[name].lower, robot.joints[name].upper = math.radians(round(lower, 9)), math.radians(round(upper, 9))
    for joint in robot.joints.values():
        assert joint.kind == "fixed" or joint.name in spans, joint.name


# ---------------------------------------------------------------------------------------------- writing
def num(v):
    v = float(v)
    return "0" if abs(v) < 1e-17 else repr(v)


def origin(m, indent):
    return f'{indent}<origin xyz="{" ".join(num(m[i][3]) for i in range(3))}" rpy="{" ".join(num(v) for v in rpy(m))}"/>\n'


def inertial(link):
    """Mass spread over the link's solid shapes by volume; moments about their common centre, in the link's axes."""
    solids = [s for s in link.shapes if s.collision] or link.shapes
    volume = sum(s.volume() for s in solids)
    masses = [link.mass * s.volume() / volume for s in solids]
    centre = [sum(m * s.pose[i][3] for m, s in zip(masses, solids)) / link.mass for i in range(3)]
    total = [[0.0] * 3 for _ in range(3)]
    for m, s in zip(masses, solids):
        own = s.inertia(m)
        d = [s.pose[i][3] - centre[i] for i in range(3)]
        d2 = sum(v * v for v in d)
        for i in range(3):
            for j in range(3):
                total[i][j] += sum(s.pose[i][k] * own[k] * s.pose[j][k] for k in range(3)) + m * ((d2 if i == j else 0) - d[i] * d[j])
    i = total
    return (f'    <inertial>\n      <origin xyz="{" ".join(num(v) for v in centre)}" rpy="0 0 0"/>\n      <mass value="{num(link.mass)}"/>\n'
            f'      <inertia ixx="{num(i[0][0])}" ixy="{num(i[0][1])}" ixz="{num(i[0][2])}" iyy="{num(i[1][1])}" iyz="{num(i[1][2])}"'
            f' izz="{num(i[2][2])}"/>\n    </inertial>\n')


def geometry_tag(shape):
    if shape.kind == "mesh":
        return f'<mesh filename="{shape.path}" scale="{" ".join(num(v) for v in shape.size)}"/>'
    if shape.kind == "box":
        return f'<box size="{" ".join(num(v) for v in shape.size)}"/>'
    if shape.kind == "sphere":
        return f'<sphere radius="{num(shape.size[0])}"/>'
    return f'<cylinder radius="{num(shape.size[0])}" length="{num(shape.size[1])}"/>'


def write_link(link):
    text = f"  <link name={quoteattr(link.name)}>\n"
    if link.mass > 0:
        text += inertial(link)
    for number, shape in enumerate(link.shapes):
        name = shape.name if shape.name.startswith(("r_", "l_")) else f"{link.name}_{number}" + ("_capsule" if shape.kind == "capsule" else "")
        body = origin(shape.pose, "      ") + f"      <geometry>{geometry_tag(shape)}</geometry>\n"
        if shape.visual:
            text += f'    <visual name="{name}">\n{body}      <material name="{shape.colour}"/>\n    </visual>\n'
        if shape.collision:
            text += f'    <collision name="{name}">\n{body}    </collision>\n'
    return text + "  </link>\n"


def write_joint(joint):
    text = f'  <joint name="{joint.name}" type="{joint.kind}">\n{origin(joint.origin, "    ")}'
    text += f'    <parent link="{joint.parent}"/>\n    <child link="{joint.child}"/>\n'
    if joint.kind == "revolute":
        text += '    <axis xyz="0 0 1"/>\n'
        text += f'    <limit lower="{num(joint.lower)}" upper="{num(joint.upper)}" effort="{num(joint.effort)}" velocity="{num(joint.velocity)}"/>\n'
        if joint.mimic:
            text += f'    <mimic joint="{joint.mimic}" multiplier="1" offset="0"/>\n'
    return text + "  </joint>\n"


def write_nido(robot):
    text = '  <!-- What URDF has no words for: docs/body.md. Angles in rad, speeds in rad/s, torques in N m. -->\n  <nido version="1" capsule_suffix="_capsule">\n'
    for part in robot.geometry["parts"]:
        text += f'    <part name="{part["part"]}">\n'
        for name, lower, upper in part["joints"]:
            hinges = coupling(name)
            effort, speed = drive(name)
            factor = max(abs(m) for _, m, _ in hinges)
            kind = name[2:] if name[:2] in ("r_", "l_") else name
            home = HOME_DEG.get(kind, 0)
            velocity = VELOCITY_DEG_S / (factor if "finger" not in name else 1.0)
            text += (f'      <axis name="{name}" lower="{num(math.radians(lower))}" upper="{num(math.radians(upper))}"'
                     f' velocity="{num(math.radians(velocity))}" effort="{num(effort)}"'
                     f' reference_speed="{num(math.radians(speed))}" home="{num(math.radians(home))}">\n')
            for joint, multiplier, offset in hinges:
                text += f'        <hinge joint="{joint}" multiplier="{num(multiplier)}" offset="{num(math.radians(offset))}"/>\n'
            text += "      </axis>\n"
        text += "    </part>\n"
    for side, s in (("left", "l"), ("right", "r")):
        text += f'    <hand name="{side}" frame="{s}_hand">\n'
        for finger in FINGERS:
            text += f'      <pad name="{finger}" link="{s}_{finger}_3" tip="{s}_{finger}_tip"/>\n'
        text += f'      <pad name="palm" link="{s}_palm" tip="{s}_hand"/>\n'
        for mark, colour in (("knuckle", "magenta"), ("wrist", "cyan")):
            text += f'      <mark name="{mark}" colour="{colour}" link="{s}_hand_mark_{mark}" radius="{num(MARK_RADIUS_M)}"/>\n'
        text += "    </hand>\n"
    for side, s in (("left", "l"), ("right", "r")):
        text += f'    <camera name="{side}" link="{s}_eye"/>\n'
    text += '    <inertial_sensor link="imu"/>\n'
    for limb, joint in (("left_arm", "l_shoulder_yaw"), ("right_arm", "r_shoulder_yaw"), ("left_leg", "l_hip_yaw"), ("right_leg", "r_hip_yaw")):
        text += f'    <force_torque limb="{limb}" joint="{joint}"/>\n'
    text += write_skin(robot)
    return text + "  </nido>\n"


def write_skin(robot):
    """Patches of skin: the frames of their triangles in the link's frame, in tenths of a millimetre and milliradians."""
    chest_box = (CHEST_CENTRE_M[0] - CHEST_SIZE_M[0] / 2, CHEST_SIZE_M[1] / 2, CHEST_CENTRE_M[2] - CHEST_SIZE_M[2] / 2)
    text = ""
    for name, link, values, triangles in icub_skin.patches(robot, SHOULDER_M, chest_box):
        text += f'    <skin name="{name}" link="{link}" values="{values}">\n'
        to_link = inverse(robot.at_zero[link])
        for number, frame in triangles:
            pose = mul(to_link, frame)
            xyz = " ".join(num(round(pose[i][3], 4)) for i in range(3))
            text += f'      <triangle number="{number}" xyz="{xyz}" rpy="{" ".join(num(round(v, 3)) for v in rpy(pose))}"/>\n'
        text += "    </skin>\n"
    return text


def urdf(robot):
    text = ('<?xml version="1.0"?>\n<!-- Written by generate_urdf.py: change that file or icub_geometry.json, not this one.\n'
            "     Geometry from iCub iKin (icub-main, BSD-3-Clause, (C) 2006-2018 Istituto Italiano di Tecnologia,\n"
            "     (C) 2006-2010 RobotCub Consortium). -->\n"
            '<robot name="icub">\n')
    for name, colour in COLOURS.items():
        text += f'  <material name="{name}"><color rgba="{" ".join(num(v) for v in colour)}"/></material>\n'
    text += "".join(write_link(link) for link in robot.links.values())
    text += "".join(write_joint(joint) for joint in robot.joints.values())
    return text + write_nido(robot) + "</robot>\n"


def main(arguments):
    robot = build(json.loads((HERE / "icub_geometry.json").read_text()))
    set_limits(robot)
    files = {HERE / "icub.urdf": urdf(robot), **{HERE / name: text for name, text in robot.mesh_files.items()}}
    stray = set((HERE / icub_looks.MESH_FOLDER).glob("*.obj")) - set(files)
    if arguments == ["--check"]:
        wrong = [p for p, text in files.items() if not p.is_file() or p.read_text() != text] + sorted(stray)
        for path in wrong:
            print(f"{path} is not what generate_urdf.py writes: run it and commit the result")
        return 1 if wrong else 0
    if arguments:
        print(__doc__)
        return 2
    (HERE / icub_looks.MESH_FOLDER).mkdir(exist_ok=True)
    for path, text in files.items():
        path.write_text(text)
    for path in stray:
        path.unlink()
    hinges = sum(j.kind == "revolute" for j in robot.joints.values())
    print(f"{HERE / 'icub.urdf'}: {len(robot.links)} links, {hinges} revolute joints, {sum(l.mass for l in robot.links.values()):.3f} kg")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
