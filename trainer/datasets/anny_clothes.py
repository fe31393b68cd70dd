"""Clothes, hair, shoes, mittens and stylised proportions, as smooth displacements of a body at rest.

Vertex i stays point i. A garment is a region of the surface, told by skinning weights and by coordinates along the
limbs. Its surface is smoothed, which hides what is under it, and moved out along its normals; the step at the
region's border is the hem. Skirts and coats that join the legs need another topology and are left out.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.spatial import cKDTree

from anny_body import Body, directed_edges, vertex_normals
from anny_pose import X, Y, Z, unit

LEG, FOOT = ("upperleg", "lowerleg", "foot", "toe"), ("foot", "toe")
ARM, HAND = ("shoulder", "upperarm", "lowerarm", "wrist", "finger", "metacarpal"), ("wrist", "finger", "metacarpal")
HEAD = ("neck03", "head", "eye")
# Share of the dressed bodies that have each piece, in the order in which they are put on.
PIECES = {"proportions": 0.35, "mittens": 0.25, "trousers": 0.7, "shirt": 0.7, "shoes": 0.7, "hair": 0.7}


class Wardrobe:
    """Dresses bodies of one topology."""

    def __init__(self, people):
        self._people, self._skeleton, self._faces = people, people.skeleton, people.faces
        edges = directed_edges(people.faces)  # closed and oriented: each edge once in each direction
        count = len(people.weights)
        average = coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count)).tocsr()
        self._average = average.multiply(1.0 / average.sum(axis=1)).tocsr()

    def dressed(self, rng, body, symmetric):
        """The body with at least two of the pieces, each drawn at random."""
        worn = {piece for piece, odds in PIECES.items() if rng.uniform() < odds}
        if len(worn) < 2:
            worn |= {"shirt", "hair"}
        body = Body(body.vertices.copy(), body.heads.copy())
        for piece in PIECES:
            if piece in worn:
                getattr(self, piece)(rng, body)
        return self._people.symmetrised(body) if symmetric else body

    # Coordinates and regions

    def joint(self, body, name):
        return body.heads[self._skeleton.index[name]]

    def weight(self, stems, side=""):
        """The share of each vertex that the bones with these stems move, [n]."""
        ids = [i for i in self._skeleton.ids(*stems) if self._skeleton.names[i].endswith(side)]
        return self._people.weights[:, ids].sum(axis=1)

    def along_leg(self, body):
        """0 at the hip, 1 at the ankle, by height; the legs hang at rest."""
        hip, ankle = self.joint(body, "upperleg01.L")[2], self.joint(body, "foot.L")[2]
        return (hip - body.vertices[:, 2]) / (hip - ankle)

    def along_arm(self, body):
        """0 at the shoulder, 1 at the elbow, 2 at the wrist."""
        along = np.zeros(len(body.vertices))
        for side in "LR":
            own = self.weight(ARM, side) > 0.0
            points = [self.joint(body, f"{name}.{side}") for name in ("upperarm01", "lowerarm01", "wrist")]
            upper, fore = (points[i + 1] - points[i] for i in (0, 1))
            t = (body.vertices[own] - points[0]) @ upper / (upper @ upper)
            s = (body.vertices[own] - points[1]) @ fore / (fore @ fore)
            along[own] = np.where((t > 1.0) | (s > 0.0), 1.0 + np.maximum(s, 0.0), t)
        return along

    def size(self, body):
        """The body's height relative to 1.7 m; thicknesses scale with it."""
        return np.ptp(body.vertices[:, 2]) / 1.7

    @staticmethod
    def loose(rng):
        """The distance of a garment from the skin in metres: a few millimetres, seldom up to 3 cm."""
        return 0.004 + 0.026 * rng.uniform() ** 2

    # Displacements

    def smooth(self, vertices, region, rounds):
        """Moves each vertex of a region to the mean of its neighbours, again and again."""
        rows = self._average[region]
        for _ in range(rounds):
            vertices[region] = rows @ vertices
        return vertices

    def soft(self, values, rounds):
        """Values at vertices, averaged over neighbours."""
        for _ in range(rounds):
            values = self._average @ values
        return values

    def inflate(self, vertices, thickness):
        """Moves vertices out along their normals, but less than halfway to a surface that they face."""
        normals = vertex_normals(vertices, self._faces)
        moved = np.flatnonzero(thickness > 0.0)
        distance, near = cKDTree(vertices).query(vertices[moved], k=40)
        towards = np.einsum("nkj,nj->nk", vertices[near] - vertices[moved][:, None], normals[moved])
        facing = np.einsum("nkj,nj->nk", normals[near], normals[moved]) < -0.3
        room = np.where(facing & (towards > 0.0), distance, np.inf).min(axis=1)
        vertices[moved] += np.minimum(thickness[moved], 0.4 * room)[:, None] * normals[moved]
        return vertices

    def stretch(self, body, stems, side, origin, matrix):
        """Applies a linear map about a point to the vertices and joints that the named bones move."""
        change = matrix - np.eye(3)
        mask = self.weight(stems, side)[:, None]
        body.vertices += mask * ((body.vertices - origin) @ change.T)
        joints = [i for i in self._skeleton.ids(*stems) if self._skeleton.names[i].endswith(side)]
        body.heads[joints] += (body.heads[joints] - origin) @ change.T

    def shorten(self, body, digit, side, factor):
        """Shortens all fingers or toes of one side."""
        for i in range(1, 6):
            base, next_joint = (self.joint(body, f"{digit}{i}-{j}.{side}").copy() for j in (1, 2))
            along = unit(next_joint - base)
            self.stretch(body, (f"{digit}{i}",), side, base, np.eye(3) + (factor - 1.0) * np.outer(along, along))

    # Pieces

    def trousers(self, rng, body):
        """Shorts to bell-bottoms, from the waist to a hem."""
        hip = self.joint(body, "upperleg01.L")[2]
        waist = hip + rng.uniform(0.15, 0.45) * (self.joint(body, "spine01")[2] - hip)
        hems = [rng.uniform(0.25, 0.55), rng.uniform(0.6, 0.8), rng.uniform(0.88, 0.97)]
        hem = rng.choice(hems, p=(0.3, 0.15, 0.55))
        along = self.along_leg(body)
        region = (self.weight(ARM) < 0.5) & (along < hem) & (body.vertices[:, 2] < waist)
        flare = rng.uniform(0.0, 0.03) * (rng.uniform() < 0.4)
        depth = self.loose(rng) + flare * np.clip((along - 0.4) / 0.5, 0.0, 1.0)
        self.cloth(rng, body, region, depth)

    def shirt(self, rng, body):
        """Vests to jumpers: a hem at the hips or above, a collar, sleeves of any length or none."""
        hip, top = self.joint(body, "upperleg01.L")[2], self.joint(body, "spine01")[2]
        hem = hip + rng.uniform(-0.02, 0.3) * (top - hip)
        sleeves = [rng.uniform(-0.1, 0.1), rng.uniform(0.4, 0.9), rng.uniform(1.5, 1.95)]
        sleeve = rng.choice(sleeves, p=(0.2, 0.35, 0.45))
        z, neck = body.vertices[:, 2], self.weight(("neck", "head", "eye"))
        on_arm = self.weight(ARM) > 0.5
        trunk = ~on_arm & (z > hem) & (neck < rng.uniform(0.3, 0.8)) & (self.weight(LEG) < 0.5)
        region = trunk | (on_arm & (self.along_arm(body) < sleeve))
        depth = 0.003 + self.loose(rng) + rng.uniform(0.0, 0.015) * np.clip((neck - 0.1) / 0.3, 0.0, 1.0)
        self.cloth(rng, body, region, depth)

    def cloth(self, rng, body, region, depth):
        """Smooths a region and lifts it by a depth in metres, with soft folds."""
        vertices = self.smooth(body.vertices, region, int(rng.integers(6, 40)))
        place = np.abs(vertices * X) + vertices * (Y + Z)  # the same folds left and right
        folds = np.zeros(len(vertices))
        for _ in range(4):
            wave = 2.0 * np.pi / rng.uniform(0.06, 0.2) * unit(rng.normal(size=3))
            folds += np.sin(place @ wave / self.size(body) + rng.uniform(0.0, 2.0 * np.pi))
        thickness = depth * (1.0 + rng.uniform(0.0, 0.25) * folds) * self.size(body)
        self.inflate(vertices, self.soft(np.where(region, np.maximum(thickness, 0.002), 0.0), 1))

    def shoes(self, rng, body):
        """Shoes or boots: toes smoothed into one, a flat sole."""
        sole, top = rng.uniform(0.005, 0.03), rng.choice([rng.uniform(0.98, 1.02), rng.uniform(0.6, 0.9)], p=(0.7, 0.3))
        width, roundness = rng.uniform(1.0, 1.25), int(rng.integers(10, 40))
        along = self.along_leg(body)
        for side in "LR":
            region = (self.weight(LEG, side) > 0.5) & (along > top)
            foot = region & (self.weight(FOOT, side) > 0.3)
            before = body.vertices[foot]
            low, extent = before.min(axis=0), np.ptp(before, axis=0)
            self.shorten(body, "toe", side, 0.25)
            toes = self.weight(("toe",), side)
            self.smooth(body.vertices, toes > 0.05, 150)  # the toes become one
            self.smooth(body.vertices, region & (self.weight(FOOT, side) > 0.0), roundness)
            shrunk = body.vertices[foot]
            restored = (shrunk - shrunk.min(axis=0)) / np.ptp(shrunk, axis=0) * extent + low
            middle = before.mean(axis=0)
            blend = np.clip((along[foot] - 0.98) / 0.09, 0.0, 1.0)[:, None]
            widened = middle + (restored - middle) * (width, 1.05, 1.0)
            body.vertices[foot] = blend * widened + (1.0 - blend) * shrunk
            self.inflate(body.vertices, np.where(region, 0.006 * self.size(body) * (1.0 - toes), 0.0))
            ankle = self.joint(body, f"foot.{side}")[2]
            height = (body.vertices[foot, 2] - body.vertices[foot, 2].min()) / (ankle - low[2])
            down = np.clip(1.0 - height / 0.45, 0.0, 1.0)
            body.vertices[foot, 2] -= sole * self.size(body) * np.sqrt(down)

    def mittens(self, rng, body):
        """Short thick fingers, or hands as soft as mittens."""
        length, thickness = rng.uniform(0.35, 0.8), rng.uniform(0.002, 0.006)
        rounds = int(rng.integers(0, 8))
        for side in "LR":
            self.shorten(body, "finger", side, length)
        fingers = self.weight(("finger",)) > 0.5
        self.smooth(body.vertices, fingers, rounds)
        self.inflate(body.vertices, thickness * self.size(body) * (self.weight(HAND) > 0.5))

    def hair(self, rng, body):
        """A cap of hair, from cropped to wide, sometimes with a bun, a crest or a brim."""
        on_head = self.weight(HEAD) > 0.6
        eyes = 0.5 * (self.joint(body, "eye.L") + self.joint(body, "eye.R"))
        crown = body.vertices[on_head][:, 2].max()
        radius = 0.75 * (crown - eyes[2])
        centre = np.array([0.0, body.vertices[on_head][:, 1].mean(), eyes[2] + 0.35 * (crown - eyes[2])])
        out = body.vertices - centre
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        axis = unit(np.array([0.0, rng.uniform(0.4, 0.9), 1.0]))
        reach = np.cos(rng.uniform(1.35, 1.85))
        # Below the forehead there is hair only behind the ears.
        hairline = np.where(out[:, 2] < 0.3, centre[1] + 0.3 * radius, eyes[1])
        region = on_head & (out @ axis > reach) & (body.vertices[:, 1] > hairline)
        self.smooth(body.vertices, region, int(rng.integers(10, 40)))
        depth = radius * np.where(rng.uniform() < 0.7, rng.uniform(0.05, 0.25), rng.uniform(0.3, 1.1))
        thickness = np.full(len(out), depth)
        kind = rng.choice(["plain", "bun", "crest", "brim"], p=(0.6, 0.15, 0.1, 0.15))
        if kind == "bun":
            place = unit(np.array([0.0, rng.uniform(0.0, 1.2), 1.0]))
            thickness += rng.uniform(0.4, 0.9) * radius * np.exp(-((1.0 - out @ place) / 0.06) ** 2)
        elif kind == "crest":
            thickness += rng.uniform(0.3, 0.7) * radius * np.exp(-((out[:, 0] / 0.2) ** 2))
        edge = np.clip((out @ axis - reach) / 0.15, 0.35, 1.0)
        thickness = region * self.soft(region * thickness * edge, 4)
        shift = thickness[:, None] * unit_rows(0.7 * out + 0.3 * axis)
        if kind == "brim":
            rim = rng.uniform(0.3, 0.8) * radius * region * self.soft(region & (out @ axis < reach + 0.25), 2)
            shift += rim[:, None] * unit_rows(out * (1.0, 1.0, 0.0))
        body.vertices += shift

    def proportions(self, rng, body):
        """Big heads, short or long legs and arms, big hands and feet, wide or narrow trunks, softer forms."""
        scale = np.diag
        hip, neck = self.joint(body, "upperleg01.L"), self.joint(body, "neck02")
        wide = rng.uniform(0.85, 1.3)
        trunk = scale((wide, wide, 1.0))
        body.vertices[:] = body.vertices @ trunk
        body.heads[:] = body.heads @ trunk
        legs = rng.choice([rng.uniform(0.5, 0.85), rng.uniform(1.0, 1.25)], p=(0.7, 0.3))
        self.stretch(body, LEG, "", np.array([0.0, 0.0, hip[2]]), scale((1.0, 1.0, legs)))
        arms, hands, feet = rng.uniform(0.7, 1.15), rng.uniform(0.9, 1.6), rng.uniform(0.9, 1.4)
        for side in "LR":
            shoulder, wrist = self.joint(body, f"upperarm01.{side}"), self.joint(body, f"wrist.{side}")
            along = unit(wrist - shoulder)
            self.stretch(body, ARM[1:], side, shoulder, np.eye(3) + (arms - 1.0) * np.outer(along, along))
            self.stretch(body, HAND, side, self.joint(body, f"wrist.{side}").copy(), hands * np.eye(3))
            self.stretch(body, FOOT, side, self.joint(body, f"foot.{side}").copy(), feet * np.eye(3))
        head = rng.choice([rng.uniform(0.9, 1.2), rng.uniform(1.25, 2.0)], p=(0.3, 0.7))
        self.stretch(body, HEAD, "", neck.copy(), head * scale((rng.uniform(0.95, 1.15), 1.0, rng.uniform(0.9, 1.1))))
        self.smooth(body.vertices, self.weight(("finger", "toe")) < 0.5, int(rng.integers(0, 25)))


def unit_rows(rows):
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
