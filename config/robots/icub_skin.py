"""Where the skin of arms and torso lies: triangles of ten taxels, by the numbers that they have on the robot's skin ports.

Which numbers are there is a fact of the robot (icub-main, BSD-3-Clause: skinGui's layouts of forearm V2, arm V2.7 and torso);
where they lie is of this file, so that they cover the shapes that this robot has.
"""
import math

VALUES = {"forearm": 384, "arm": 768, "torso": 768}  # of a port: twelve a triangle, many of which do not exist
FOREARM = [*range(0, 18), 19, 22, 24, 25, 28, 29]
ARM = [2, 3, 4, 5, 6, 16, 17, 22, 24, 25, 26, 27, 28, 29, 30, 31, *range(32, 41), 44, 45, 48, 53, 56, 57, 58, 59, 61, 63]
TORSO_LEFT = [*range(32, 48), 49, 50, 52, *range(56, 63)]
TORSO_RIGHT = [5, 6, 7, 8, 9, 10, 11, 17, 18, 19, 22, 23, 24, 25, 26, 27, 28, 29]


def triangle(p, out, up):
    """Its frame: origin in its middle, z out of the body, y to its tip."""
    x = [up[1] * out[2] - up[2] * out[1], up[2] * out[0] - up[0] * out[2], up[0] * out[1] - up[1] * out[0]]
    return [[x[i], up[i], out[i], p[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def round_limb(numbers, axis_x, axis_y, z, half_m, radius_m, side, rows_m, first_deg, step_deg):
    """Rows of triangles round a hanging limb (a capsule along z with its middle at `z`), tips up and down in turn. Angles
    from the front to the outside, so that left and right are mirrored."""
    columns = -(-len(numbers) // len(rows_m))
    found = []
    for k, number in enumerate(numbers):
        along, around = rows_m[k // columns], math.radians(first_deg + step_deg * (k % columns))
        beyond = math.copysign(max(0.0, abs(along) - half_m), along)  # on the round end
        tilt = beyond / radius_m
        flat, rise = math.cos(tilt), math.sin(tilt)
        way = (-math.cos(around), side * math.sin(around))
        out = [way[0] * flat, way[1] * flat, rise]
        at = [axis_x + radius_m * out[0], axis_y + radius_m * out[1], z + along - beyond + radius_m * rise]
        tip = 1 if k % 2 == 0 else -1
        up = [-tip * way[0] * rise, -tip * way[1] * rise, tip * flat]
        found.append((number, triangle(at, out, up)))
    return found


def chest(front_x_m, half_width_m, bottom_m):
    """Four rows on each half of the front; the left half has more triangles than the right one, they lie on its flank."""
    found = []
    for numbers, side in ((TORSO_RIGHT, 1), (TORSO_LEFT, -1)):
        for k, number in enumerate(numbers):
            row, column, tip = k % 4, k // 4, 1 if (k + k // 4) % 2 == 0 else -1
            z = bottom_m + 0.0125 + 0.025 * row
            if column < 4:
                at, out = [front_x_m, side * (0.0085 + 0.017 * column), z], [-1.0, 0.0, 0.0]
            else:
                at, out = [front_x_m + 0.0145 + 0.017 * (column - 4), side * half_width_m, z], [0.0, float(side), 0.0]
            found.append((number, triangle(at, out, [0.0, 0.0, float(tip)])))
    return found


def patches(robot, shoulder, chest_box):
    """(name, link, values, [(number, frame in the root's frame at zero angles)]) of each patch. shoulder: x, and y of the
    right one; chest_box: front, half the width, bottom."""
    found = []
    for name, s, side in (("left", "l", -1), ("right", "r", 1)):
        x, y = shoulder[0], side * shoulder[1]
        forearm, arm = (next(shape for shape in robot.links[f"{s}_{link}"].shapes if shape.collision) for link in ("forearm", "upper_arm"))
        found.append((f"{name}_forearm", f"{s}_forearm", VALUES["forearm"],
                      round_limb(FOREARM, x, y, -0.0675, forearm.size[1] / 2, forearm.size[0], side, (0.020, 0.0, -0.020), 0, 45)))
        found.append((f"{name}_arm", f"{s}_upper_arm", VALUES["arm"],
                      round_limb(ARM, x, y, 0.0975, arm.size[1] / 2, arm.size[0], side, (0.028, 0.0, -0.028), -60, 30)))
    found.append(("torso", "chest", VALUES["torso"], chest(*chest_box)))
    return found
