"""What the robot looks like where plain solids do not do: covers, face, eyes. For the cameras only; what touches and
weighs are the solids of generate_urdf.py, which the covers follow closely.

Covers are lofts: rings of rounded cross-section stacked along an axis, closed at both ends. All places are in the root
frame with all joints at zero; the pose in the URDF takes them into the link's frame. Left parts are mirror images.
"""
import math

MESH_FOLDER = "meshes"
COLOURS = {
    "cover": (0.86, 0.86, 0.87, 1), "seam": (0.20, 0.20, 0.21, 1), "rubber": (0.16, 0.16, 0.17, 1), "iris": (0.16, 0.20, 0.23, 1),
    "pupil": (0.012, 0.012, 0.014, 1), "brow": (0.80, 0.12, 0.10, 1), "mouth": (0.80, 0.12, 0.10, 1), "glint": (1, 1, 1, 1), "joint": (0.30, 0.30, 0.32, 1),
    "lid": (0.74, 0.74, 0.75, 1), "panel": (0.62, 0.63, 0.65, 1),
}


class Mesh:
    def __init__(self):
        self.points, self.faces = [], []

    def text(self, title):
        lines = [f"# {title}: written by generate_urdf.py; metres, robot's root frame at zero angles"]
        lines += ["v " + " ".join(f"{v:.5f}" for v in p) for p in self.points]
        lines += ["f " + " ".join(str(i + 1) for i in f) for f in self.faces]
        return "\n".join(lines) + "\n"


def superellipse(angle, ru, rv, power):
    c, s = math.cos(angle), math.sin(angle)
    return (ru * math.copysign(abs(c) ** (2 / power), c), rv * math.copysign(abs(s) ** (2 / power), s))


def loft(rings, axis="z", segments=20):
    """rings: (place along the axis, centre u, centre v, radius u, radius v, power) with growing places, where (u, v) are
    (x, y) for axis z, (y, z) for axis x and (z, x) for axis y, so that u x v points along the axis. Power 2 is an ellipse,
    more is boxier. Ends are closed with a flat fan: give a small last ring for a round end."""
    mesh = Mesh()
    order = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}[axis]

    def put(u, v, t):
        point = [0.0, 0.0, 0.0]
        for place, value in zip(order, (u, v, t)):
            point[place] = value
        mesh.points.append(point)

    for t, cu, cv, ru, rv, power in rings:
        for k in range(segments):
            u, v = superellipse(2 * math.pi * k / segments, ru, rv, power)
            put(cu + u, cv + v, t)
    for i in range(len(rings) - 1):
        for k in range(segments):
            a, b = i * segments + k, i * segments + (k + 1) % segments
            c, d = b + segments, a + segments
            mesh.faces += [(a, b, c), (a, c, d)]
    for end, ring in ((0, rings[0]), (len(rings) - 1, rings[-1])):
        put(ring[1], ring[2], ring[0])
        middle = len(mesh.points) - 1
        for k in range(segments):
            a, b = end * segments + k, end * segments + (k + 1) % segments
            mesh.faces.append((middle, b, a) if end == 0 else (middle, a, b))
    return mesh


def rounded(rings, start_m, end_m, steps=4):
    """Closes a loft's ends with quarter ellipses of the given depth instead of flat lids."""
    def cap(ring, depth, sign):
        t, cu, cv, ru, rv, power = ring
        made = []
        for i in range(1, steps + 1):
            a = 0.5 * math.pi * i / steps * 0.985
            made.append((t + sign * depth * math.sin(a), cu, cv, ru * math.cos(a), rv * math.cos(a), power))
        return made
    return list(reversed(cap(rings[0], start_m, -1))) + rings + cap(rings[-1], end_m, 1)


def tube(points, radius, segments=6):
    """A thin tube along points that lie nearly in a plane across x."""
    mesh = Mesh()
    n = len(points)
    for i, p in enumerate(points):
        q, r = points[max(i - 1, 0)], points[min(i + 1, n - 1)]
        d = [r[k] - q[k] for k in range(3)]
        length = math.sqrt(sum(v * v for v in d))
        d = [v / length for v in d]
        out = [-1.0 + d[0] * d[0], d[0] * d[1], d[0] * d[2]]  # towards the front, across the tube
        length = math.sqrt(sum(v * v for v in out))
        out = [v / length for v in out]
        side = [d[1] * out[2] - d[2] * out[1], d[2] * out[0] - d[0] * out[2], d[0] * out[1] - d[1] * out[0]]
        thick = radius * (0.55 if i in (0, n - 1) else 1.0)
        for k in range(segments):
            a = 2 * math.pi * k / segments
            mesh.points.append([p[j] + thick * (math.cos(a) * out[j] + math.sin(a) * side[j]) for j in range(3)])
    for i in range(n - 1):
        for k in range(segments):
            a, b = i * segments + k, i * segments + (k + 1) % segments
            mesh.faces += [(a, b, b + segments), (a, b + segments, a + segments)]
    for end, point in ((0, points[0]), (n - 1, points[-1])):
        mesh.points.append(list(point))
        middle = len(mesh.points) - 1
        for k in range(segments):
            a, b = end * segments + k, end * segments + (k + 1) % segments
            mesh.faces.append((middle, b, a) if end == 0 else (middle, a, b))
    return mesh


def cap(centre, radius, half_angle_deg, rings=3, segments=16):
    """The part of a ball around its foremost point (-x), closed at the back."""
    x, y, z = centre
    rows = []
    for i in range(rings + 1):
        a = math.radians(half_angle_deg) * (rings - i) / rings if i < rings else 0.02
        r = radius * math.sin(a)
        rows.append((-(x - radius * math.cos(a)), y, z, r, r, 2))
    mesh = loft([(t, -cu, cv, ru, rv, p) for t, cu, cv, ru, rv, p in rows], "x", segments)
    for p in mesh.points:  # turned by half a revolution about z
        p[0], p[1] = -p[0], -p[1]
    return mesh


# ---------------------------------------------------------------------------------------------- head
# A superellipsoid: rounder than an egg, so that the face is broad and rather flat and the eyes sit in it.
HEAD = {"centre": (0.014, 0.0, 0.372), "front": 0.083, "back": 0.082, "half_width": 0.076, "up": 0.080, "down": 0.089}
ACROSS, UPWARDS = 2.5, 2.3  # powers of its outlines


def across(height):
    """How much of its girth the head has at a height; 0: in the middle, 1: at its top or chin."""
    return max(0.0, 1 - height ** UPWARDS) ** (1 / UPWARDS)


def half_width(z):
    """Narrower towards the chin."""
    below = max(0.0, (HEAD["centre"][2] - z) / HEAD["down"])
    return HEAD["half_width"] * (1 - 0.13 * below * below)


def face_x(y, z, lift=0.0):
    """Where the head's front is at (y, z)."""
    cx, _, cz = HEAD["centre"]
    b, c = half_width(z), HEAD["up"] if z > cz else HEAD["down"]
    inside = across(abs(z - cz) / c) ** ACROSS - abs(y / b) ** ACROSS
    return cx - HEAD["front"] * max(inside, 0.0) ** (1 / ACROSS) - lift


def head_shell():
    """Broad above, narrower at the chin."""
    cx, _, cz = HEAD["centre"]
    rings = []
    steps = 20
    for i in range(steps + 1):
        a = -0.5 * math.pi + math.pi * i / steps
        a *= 0.985
        h = HEAD["up"] if a > 0 else HEAD["down"]
        height = math.copysign(abs(math.sin(a)) ** (2 / UPWARDS), a)
        r = across(abs(height))
        z = cz + h * height
        rings.append((z, cx, 0.0, 1.0 * r, half_width(z) * r, ACROSS))
    mesh = loft(rings, "z", 36)
    for p in mesh.points:
        d = p[0] - cx
        p[0] = cx + d * (HEAD["front"] if d < 0 else HEAD["back"])
    return mesh


def on_face(points, lift):
    return [(face_x(y, z, lift), y, z) for y, z in points]


def arc(y0, y1, z_of, count=9):
    return [(y0 + (y1 - y0) * i / (count - 1), z_of((2.0 * i / (count - 1)) - 1)) for i in range(count)]


def seam():
    """A dark groove between face and back of the head."""
    cx, _, cz = HEAD["centre"]
    rings = []
    for t, grow in ((cx + 0.006, 0.9), (cx + 0.0065, 1.006), (cx + 0.0105, 1.006), (cx + 0.011, 0.9)):
        rings.append((t, 0.0, cz, grow, grow, 2.4))
    mesh = loft(rings, "x", 36)
    for p in mesh.points:
        p[2] = cz + (p[2] - cz) * (HEAD["up"] if p[2] > cz else HEAD["down"])
        p[1] *= half_width(p[2])
    return mesh


EYE = (-0.0628, 0.034, 0.3408)  # middle of the right one


def lid(centre, radius, lower_edge_deg, rings=6, segments=20):
    """An upper eyelid: the part of a ball round the eye that lies above a plane through its left and right."""
    tip, mesh = math.radians(lower_edge_deg), Mesh()
    for i in range(rings + 1):
        up = tip + (math.radians(150) - tip) * i / rings  # 0: to the front, 90 degrees: up
        for k in range(segments + 1):
            side = math.pi * k / segments
            r = radius * math.sin(side)
            mesh.points.append([centre[0] - r * math.cos(up), centre[1] + radius * math.cos(side), centre[2] + r * math.sin(up)])
    row = segments + 1
    for i in range(rings):
        for k in range(segments):
            a = i * row + k
            mesh.faces += [(a, a + 1, a + row + 1), (a, a + row + 1, a + row)]
    return mesh


def glint(centre, radius):
    """The lamp's reflection, a small disc beside the pupil."""
    mesh = cap((0.0, 0.0, 0.0), radius, 5, 2, 10)
    c, s = math.cos(math.radians(17)), math.sin(math.radians(17))
    for p in mesh.points:
        x, z = p[0] * c + p[2] * s, -p[0] * s + p[2] * c
        p[0], p[1], p[2] = centre[0] + x, centre[1] + p[1], centre[2] + z
    return mesh


# ---------------------------------------------------------------------------------------------- the whole
def looks():
    """(name, link, colour, mesh, both sides) of everything; link names of two-sided things are without 'r_'."""
    parts = [
        ("head_shell", "head", "cover", head_shell(), False),
        ("head_seam", "head", "seam", seam(), False),
        ("mouth", "head", "mouth", tube(on_face(arc(-0.021, 0.021, lambda t: 0.3075 + 0.0040 * t * t), 0.0004), 0.0023), False),
        ("brow", "head", "brow", tube(on_face(arc(0.018, 0.050, lambda t: 0.3785 - 0.004 * t * t - 0.001 * t), 0.0004), 0.0026), True),
        ("eye_cup", "head", "cover", loft(rounded([(-0.0665, EYE[1], EYE[2], 0.0222, 0.0222, 2), (-0.040, EYE[1], EYE[2], 0.0240, 0.0240, 2)],
                                                  0.0025, 0.001, 3), "x", 28), True),
        ("eye_socket", "head", "rubber", loft([(-0.0696, EYE[1], EYE[2], 0.0196, 0.0196, 2), (-0.0650, EYE[1], EYE[2], 0.0200, 0.0200, 2)], "x", 28), True),
        ("eyelid", "head", "lid", lid(EYE, 0.0181, 27), True),
        ("chest_cover", "chest", "cover", loft(rounded([
            (0.092, 0.012, 0, 0.040, 0.046, 3), (0.110, 0.011, 0, 0.050, 0.057, 3), (0.135, 0.009, 0, 0.056, 0.068, 2.8),
            (0.160, 0.008, 0, 0.056, 0.0755, 2.8), (0.185, 0.007, 0, 0.048, 0.0755, 2.6), (0.203, 0.004, 0, 0.036, 0.060, 2.4)],
            0.010, 0.014), "z", 28), False),
        ("chest_panel", "chest", "panel", loft(rounded([(-0.050, 0.0, 0.146, 0.030, 0.021, 3.5), (-0.040, 0.0, 0.146, 0.032, 0.023, 3.5)], 0.0015, 0.0, 2),
                                               "x", 24), False),
        ("pelvis_cover", "root_link", "cover", loft(rounded([
            (-0.118, 0.0, 0, 0.040, 0.046, 2.6), (-0.100, 0.0, 0, 0.052, 0.062, 2.6), (-0.075, 0.0, 0, 0.056, 0.071, 2.6),
            (-0.050, 0.0, 0, 0.054, 0.066, 2.6), (-0.036, 0.0, 0, 0.044, 0.054, 2.6)], 0.010, 0.008), "z", 24), False),
    ]
    y = 0.0681
    parts += [
        ("thigh_cover", "thigh", "cover", loft(rounded([
            (-0.305, 0.000, y, 0.034, 0.032, 2.3), (-0.280, -0.002, y, 0.038, 0.036, 2.3), (-0.230, -0.003, y, 0.044, 0.041, 2.3),
            (-0.190, -0.002, y, 0.045, 0.042, 2.3), (-0.165, 0.0, y, 0.041, 0.039, 2.3)], 0.012, 0.016), "z", 18), True),
        ("shank_cover", "shank", "cover", loft(rounded([
            (-0.520, 0.002, y, 0.026, 0.025, 2.3), (-0.480, 0.004, y, 0.030, 0.029, 2.3), (-0.420, 0.006, y, 0.036, 0.034, 2.3),
            (-0.385, 0.003, y, 0.035, 0.034, 2.3), (-0.365, 0.0, y, 0.031, 0.031, 2.3)], 0.010, 0.014), "z", 18), True),
        ("knee", "shank", "joint", loft([(y - 0.031, -0.3360, 0.0, 0.022, 0.022, 2), (y - 0.029, -0.3360, 0.0, 0.026, 0.026, 2),
                                         (y + 0.029, -0.3360, 0.0, 0.026, 0.026, 2), (y + 0.031, -0.3360, 0.0, 0.022, 0.022, 2)], "y", 18), True),
        ("foot_cover", "ankle_2", "cover", loft(rounded([
            (-0.5935, -0.028, y, 0.0725, 0.032, 3.2), (-0.586, -0.027, y, 0.0715, 0.032, 3.2), (-0.576, -0.018, y, 0.058, 0.030, 2.8),
            (-0.567, -0.007, y, 0.040, 0.027, 2.6)], 0.0, 0.008, 3), "z", 22), True),
        ("foot_sole", "ankle_2", "rubber", loft([(-0.5975, -0.028, y, 0.0735, 0.033, 3.2), (-0.5930, -0.028, y, 0.0740, 0.0335, 3.2)], "z", 22), True),
    ]
    x, y = -0.0108, 0.1101
    parts += [
        ("upper_arm_cover", "upper_arm", "cover", loft(rounded([
            (0.046, x, y, 0.025, 0.025, 2.2), (0.070, x, y, 0.028, 0.028, 2.2), (0.110, x, y, 0.031, 0.030, 2.2), (0.140, x, y, 0.029, 0.029, 2.2)],
            0.008, 0.012), "z", 16), True),
        ("forearm_cover", "forearm", "cover", loft(rounded([
            (-0.094, x, y, 0.0185, 0.0185, 2.3), (-0.080, x, y, 0.0225, 0.0225, 2.3), (-0.058, x, y, 0.027, 0.026, 2.3), (-0.044, x, y, 0.025, 0.0245, 2.3)],
            0.006, 0.008), "z", 16), True),
    ]
    parts += [
        ("eye_white", "eye_ball", "eye", cap(EYE, 0.0170, 100, 12, 28), True),
        ("iris", "eye_ball", "iris", cap(EYE, 0.0173, 33, 4, 24), True),
        ("pupil", "eye_ball", "pupil", cap(EYE, 0.0176, 16, 2, 20), True),
        ("glint", "eye_ball", "glint", glint(EYE, 0.0178), True),
    ]
    return parts


# Solids that a cover hides: they stay for physics but are not drawn. (link without side, number of the solid)
HIDDEN = [("root_link", 0), ("chest", 0), ("chest", 1), ("chest", 3), ("head", 0), ("head", 1), ("head", 3), ("upper_arm", 0), ("forearm", 0),
          ("thigh", 0), ("shank", 0), ("ankle_2", 0), ("eye_ball", 0), ("eye_ball", 1)]


def sided(link, side):
    return f"{side}_{link}" if link == "eye_ball" else f"{side[0]}_{link}"


def dress(robot, make_shape):
    """Adds the covers to the links; make_shape(path, scale, colour, name) makes a mesh shape in the root frame. Returns the
    files to write: name -> text."""
    for link, number in HIDDEN:
        for name in ([link] if link in robot.links else [sided(link, "right"), sided(link, "left")]):
            robot.links[name].shapes[number].visual = False
    files = {}
    for name, link, colour, mesh, both in looks():
        files[f"{MESH_FOLDER}/{name}.obj"] = mesh.text(name)
        if not both:
            robot.dress(link, make_shape(f"{MESH_FOLDER}/{name}.obj", (1, 1, 1), colour, name))
            continue
        if link == "head":
            robot.dress(link, make_shape(f"{MESH_FOLDER}/{name}.obj", (1, 1, 1), colour, "right_" + name),
                        make_shape(f"{MESH_FOLDER}/{name}.obj", (1, -1, 1), colour, "left_" + name))
            continue
        robot.dress(sided(link, "right"), make_shape(f"{MESH_FOLDER}/{name}.obj", (1, 1, 1), colour, "right_" + name))
        robot.dress(sided(link, "left"), make_shape(f"{MESH_FOLDER}/{name}.obj", (1, -1, 1), colour, "left_" + name))
    return files
