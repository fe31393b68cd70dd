"""Poses: random, wild and rest ones, and linear blend skinning that applies them.

A pose gives each bone a rotation about its head in the axes of the body at rest, which its children inherit.
Limbs are described for the left side; the right side is the mirror image of a left one.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from anny_body import MIRROR, vertex_normals

FINGERS = (2, 3, 4, 5)
REST_POSES = ("t", "a", "hanging", "standing")
WILD_POSES = ("overhead", "crouch", "kick", "bend", "sit", "run")
RANDOM_SHARE, REST_SHARE, SYMMETRIC_SHARE_OF_REST = 0.55, 0.25, 1 / 3
DEPTH, INSIDE_SHARE = 0.012, 0.02
X, Y, Z = np.eye(3)


def random_kind(rng):
    """The name of a pose, and whether body and pose are exactly symmetric."""
    draw = rng.uniform()
    if draw < RANDOM_SHARE:
        return "random", False
    if draw < RANDOM_SHARE + REST_SHARE:
        return rng.choice(REST_POSES), rng.uniform() < SYMMETRIC_SHARE_OF_REST
    return rng.choice(WILD_POSES), False


def unit(vector):
    return vector / np.linalg.norm(vector)


def turn(axis, angle):
    """The rotation about an axis by an angle in radians, [3, 3]."""
    return Rotation.from_rotvec(unit(axis) * angle).as_matrix()


def aim(start, target):
    """The smallest rotation vector that takes one direction to another; about y if they are opposite."""
    start, target = unit(start), unit(target)
    axis = np.cross(start, target)
    sine = np.linalg.norm(axis)
    if sine < 1e-9:
        return np.zeros(3) if start @ target > 0 else np.pi * Y
    return axis / sine * np.arctan2(sine, start @ target)


def angle_between(a, b):
    return np.arccos(np.clip(unit(a) @ unit(b), -1.0, 1.0))


def share(rotvec, part):
    """A part of a rotation, given as a rotation vector, as a matrix."""
    return Rotation.from_rotvec(part * np.asarray(rotvec)).as_matrix()


def arm(rng, kind, joint, wildness, spread):
    """Rotations of one left arm without its hand; `joint(name)` is a bone's head at rest."""
    upper = joint("lowerarm01") - joint("upperarm01")
    fore = joint("wrist") - joint("lowerarm01")
    side, front = 0.0, 0.0  # the upper arm's angle from hanging down, to the side and to the front
    flexion, upper_twist, fore_twist = rng.uniform(0.05, 0.3), 0.0, rng.normal(0.0, 0.2)
    if kind == "t":
        side = np.pi / 2 + rng.uniform(-0.05, 0.05)
    elif kind == "a":
        side = rng.uniform(0.5, 0.95)
    elif kind in ("hanging", "standing"):
        side, front = rng.uniform(0.08, 0.2), rng.uniform(0.0, 0.12)
        flexion = rng.uniform(0.1, 0.5) if kind == "standing" else flexion
    elif kind == "overhead":
        side, front, flexion = rng.uniform(2.3, 2.95), rng.uniform(-0.2, 0.4), rng.uniform(0.1, 0.9)
    else:
        side = np.clip(0.75 + wildness * rng.normal(0.0, 0.55), 0.1, 2.4)
        front = np.clip(0.2 + wildness * rng.normal(0.0, 0.6), -0.7, 1.7)
        flexion = np.clip(0.6 + wildness * rng.normal(0.0, 0.6), 0.0, 2.2)
        upper_twist, fore_twist = wildness * rng.normal(0.2, 0.5), rng.normal(0.0, 0.5)
    side = side + spread if side < 1.2 else side
    direction = np.array([np.sin(side) * np.cos(front), -np.sin(front), -np.cos(side) * np.cos(front)])
    swing = aim(upper, direction)
    lift = 0.25 * np.clip((np.linalg.norm(swing) - 0.4) / 1.2, 0.0, 1.0)  # the shoulder follows a raised arm
    hinge = np.cross(upper, fore)  # the elbow bends as it is bent at rest
    return {
        "clavicle": share(swing, lift),
        "upperarm01": share(swing, 1.0 - lift) @ turn(upper, upper_twist * 0.6),
        "upperarm02": turn(upper, upper_twist * 0.4),
        "lowerarm01": turn(hinge, flexion - angle_between(upper, fore)) @ turn(fore, fore_twist * 0.3),
        "lowerarm02": turn(fore, fore_twist * 0.7),
    }


def leg(rng, kind, joint, wildness, lead):
    """Rotations of one left leg; the leading leg is the one that kicks or steps forward."""
    thigh = joint("lowerleg01") - joint("upperleg01")
    shank = joint("foot") - joint("lowerleg01")
    front, side, knee, twist, ankle = 0.0, rng.uniform(0.03, 0.12), 0.05, 0.0, 0.0
    if kind == "crouch":
        front, knee, ankle = rng.uniform(1.2, 1.9), rng.uniform(1.3, 2.1), rng.uniform(0.1, 0.5)
        side = rng.uniform(0.15, 0.6)
    elif kind == "sit":
        front, knee, side = rng.uniform(1.3, 1.65), rng.uniform(0.9, 1.7), rng.uniform(0.08, 0.4)
    elif kind == "kick" and lead:
        front, knee, side = rng.uniform(0.9, 1.6), rng.uniform(0.0, 0.7), rng.uniform(0.0, 0.7)
    elif kind == "run":
        front = rng.uniform(0.7, 1.3) if lead else rng.uniform(-0.7, -0.2)
        knee = rng.uniform(0.5, 1.4)
    elif kind == "bend":
        front, knee, side = rng.uniform(0.2, 0.9), rng.uniform(0.0, 0.7), rng.uniform(0.05, 0.4)
    elif kind in REST_POSES:
        side = rng.uniform(0.04, 0.3)
    else:
        front = np.clip(0.15 + wildness * rng.normal(0.0, 0.45), -0.6, 1.6)
        side = np.clip(0.15 + wildness * abs(rng.normal(0.0, 0.3)), 0.0, 0.9)
        knee = np.clip(0.15 + max(front, 0.0) * 0.5 + wildness * abs(rng.normal(0.0, 0.45)), 0.0, 2.1)
        twist, ankle = wildness * rng.normal(0.1, 0.2), rng.normal(0.0, 0.2)
    direction = np.array([np.sin(side), -np.sin(front) * np.cos(side), -np.cos(front) * np.cos(side)])
    swing = aim(thigh, direction)
    hinge = X - (X @ unit(thigh)) * unit(thigh)
    straight = angle_between(thigh, shank) * np.sign(hinge @ np.cross(thigh, shank))
    return {
        "pelvis": share(swing, 0.08),
        "upperleg01": share(swing, 0.92) @ turn(thigh, -twist * 0.6),
        "upperleg02": turn(thigh, -twist * 0.4),
        "lowerleg01": turn(hinge, knee - straight),
        "foot": turn(X, -ankle) @ turn(Y, rng.normal(0.0, 0.08)),
    }


def hand(rng, kind, joint):
    """Rotations of one left wrist and its fingers, from spread to a fist."""
    along = unit(joint("finger3-1") - joint("wrist"))
    across = unit(joint("finger2-1") - joint("finger5-1"))  # towards the thumb
    palm = unit(np.cross(along, across))
    if kind in REST_POSES:
        shapes, odds, wrist = ("relaxed", "flat", "spread"), (0.5, 0.3, 0.2), 0.08
    else:
        shapes, odds, wrist = ("relaxed", "flat", "spread", "fist", "point", "any"), (0.2, 0.1, 0.2, 0.2, 0.1, 0.2), 0.3
    shape = rng.choice(shapes, p=odds)
    rotations = {"wrist": share(wrist * rng.normal(0.0, 1.0, 3), 1.0)}
    fist, any_curl = rng.uniform(0.75, 1.0), rng.uniform(0.0, 0.9)
    common = {"flat": 0.05, "spread": 0.02, "fist": fist, "any": any_curl}.get(shape, 0.25)
    apart = rng.uniform(0.06, 0.16) if shape == "spread" else 0.0
    for finger in FINGERS:
        curl = np.clip(common + rng.normal(0.0, 0.12 if shape == "any" else 0.03), 0.0, 1.0)
        if shape == "point":
            curl = 0.05 if finger == 2 else 0.85
        base, middle, tip = (joint(f"finger{finger}-{i}") for i in (1, 2, 3))
        metacarpal = base - joint("wrist")
        axis = np.cross(middle - base, palm)
        rotations[f"finger{finger}-1"] = turn(axis, 1.3 * curl - bend(metacarpal, middle - base, axis)) @ turn(
            palm, -apart * (finger - 3.3)
        )
        rotations[f"finger{finger}-2"] = turn(axis, 1.55 * curl - bend(middle - base, tip - middle, axis))
        rotations[f"finger{finger}-3"] = turn(axis, 0.9 * curl - 0.1)
    thumb = joint("finger1-2") - joint("finger1-1")
    inwards = np.cross(thumb, palm - 0.6 * across)
    closing = {"fist": 0.45, "point": 0.45, "spread": -0.2, "any": rng.uniform(-0.2, 0.4)}.get(shape, 0.0)
    for i, part in ((1, 0.5), (2, 0.8), (3, 1.0)):
        rotations[f"finger1-{i}"] = turn(inwards, closing * part)
    return rotations


def bend(before, after, axis):
    """The signed angle from one segment to the next about an axis."""
    return angle_between(before, after) * np.sign(axis @ np.cross(before, after))


def trunk(rng, kind, wildness, symmetric):
    """Rotations of spine, neck and head: forward is a positive angle about x."""
    sway = 0.0 if symmetric else 1.0
    if kind in REST_POSES:
        spine, neck = 0.03 * rng.normal(size=3), 0.06 * rng.normal(size=3)
    else:
        spine = wildness * rng.normal(size=3) * (0.2, 0.12, 0.18) + (0.08, 0.0, 0.0)
        neck = rng.normal(size=3) * (0.2, 0.12, 0.3)
    if kind == "bend":
        spine[0] = rng.uniform(0.5, 1.2)
    elif kind in ("crouch", "sit"):
        spine[0] = rng.uniform(0.0, 0.5)
    spine, neck = spine * (1.0, sway, sway), neck * (1.0, sway, sway)
    rotations = {f"spine0{i}": share(spine, 0.2) for i in (1, 2, 3, 4, 5)}
    return rotations | {name: share(neck, 0.25) for name in ("neck01", "neck02", "neck03", "head")}


def joints(skeleton, heads, side):
    """The function that gives a joint of one side by its name without the side."""
    return lambda name: heads[skeleton.index[f"{name}.{side}"]]


def random_pose(rng, kind, symmetric, skeleton, heads, attempt=0):
    """A rotation for each bone, [b, 3, 3]. Later attempts hold the arms further from the body."""
    wildness = {"random": 1.0}.get(kind, 0.7)
    rotations = trunk(rng, kind, wildness, symmetric)
    spread = 0.06 * attempt
    leader, both = rng.choice(["L", "R"]), int(rng.integers(2**32))
    for side in "LR":
        draw = np.random.default_rng(both) if symmetric else rng
        sign = np.ones(3) if side == "L" else MIRROR
        joint = joints(skeleton, heads * sign, side)
        limbs = arm(draw, kind, joint, wildness, spread)
        limbs |= leg(draw, kind, joint, wildness, side == leader) | hand(draw, kind, joint)
        rotations |= {f"{name}.{side}": sign[:, None] * matrix * sign for name, matrix in limbs.items()}
    identity = np.eye(3)
    return np.array([rotations.get(name, identity) for name in skeleton.names])


def skinned(body, weights, skeleton, rotations):
    """Vertices of the posed body, its lowest point at z = 0, by linear blend skinning."""
    turns, shifts = np.empty_like(rotations), np.empty((len(rotations), 3))
    for bone, parent in enumerate(skeleton.parents):  # parents come first
        about_head = body.heads[bone] - rotations[bone] @ body.heads[bone]
        if parent < 0:
            turns[bone], shifts[bone] = rotations[bone], about_head
        else:
            turns[bone] = turns[parent] @ rotations[bone]
            shifts[bone] = turns[parent] @ about_head + shifts[parent]
    blended = np.einsum("nb,bij->nij", weights, turns, optimize=True)
    vertices = np.einsum("nij,nj->ni", blended, body.vertices) + weights @ shifts
    return vertices - vertices[:, 2].min() * Z


class Interpenetration:
    """Tells whether a limb is deep inside another part, by the side on which the nearest vertex sees it."""

    def __init__(self, skeleton, weights, faces):
        self._faces = faces
        bone = weights.argmax(axis=1)
        part = {}
        for side in "LR":
            fore = skeleton.ids("lowerarm", "wrist", "finger", "metacarpal")
            upper = skeleton.ids("upperarm", "shoulder")
            part["fore", side] = self._of(skeleton, bone, fore, side)
            part["arm", side] = part["fore", side] | self._of(skeleton, bone, upper, side)
            part["shank", side] = self._of(skeleton, bone, skeleton.ids("lowerleg", "foot", "toe"), side)
            part["thigh", side] = self._of(skeleton, bone, skeleton.ids("upperleg"), side)
            part["low thigh", side] = self._of(skeleton, bone, skeleton.ids("upperleg02"), side)
        self._tests = []
        for side, other in ("LR", "RL"):
            own_leg = part["shank", side] | part["thigh", side]
            self._tests.append((part["fore", side], ~part["arm", side]))
            self._tests.append((part["shank", side], ~own_leg))
            self._tests.append((part["low thigh", side], part["shank", other] | part["thigh", other]))

    @staticmethod
    def _of(skeleton, bone, ids, side):
        return np.isin(bone, [i for i in ids if skeleton.names[i].endswith(side)])

    def is_bad(self, vertices):
        """More than a fiftieth of a limb lies deeper than 1.2 % of the body's extent in another part."""
        depth = DEPTH * np.ptp(vertices, axis=0).max()
        normals = vertex_normals(vertices, self._faces)
        for limb, others in self._tests:
            nearest = cKDTree(vertices[others]).query(vertices[limb])[1]
            height = np.einsum("ni,ni->n", vertices[limb] - vertices[others][nearest], normals[others][nearest])
            if np.mean(height < -depth) > INSIDE_SHARE:
                return True
        return False
