"""People for training: writes a dataset folder for `fmnet-train` with bodies made by the Python package `anny`.

    pip install -r requirements.txt
    python anny.py OUT --count 400 --seed 0

OUT then has `people/NAME.ply`, closed meshes in metres (x left, y back, z up) that all have the same vertices and
triangles, so vertex i is point i, and `dataset.toml`, which lists them as group `biped-anny`. Nine in ten are for
training, the rest for validation. The ages run from child to old. About 55 % have random poses, 20 % wild ones
(arms overhead, crouch, kick, bend, sit, run) and 25 % rest poses (T, A, arms hanging, standing), a third of which are
exactly symmetric, body and pose. With `--dressed 0.2` a fifth of them wear clothes, hair, shoes or mittens, or have
stylised proportions, all as displacements of the same surface.

The same options give the same people. A person that is already there is kept, so an interrupted run goes on where it
stopped; a file made with other options stops it. The first run prepares anny's data: about a minute, and 1.2 GB in
anny's cache folder (ANNY_CACHE_DIR, by default ~/.cache/anny).

The code of `anny` (https://github.com/naver/anny) is under the Apache License 2.0; the data that this script uses,
from MakeHuman, are CC0, so the meshes are free for any use. Neither fmnet nor its tests need this script.
"""

import sys

# This file has the package's name: look for modules beside it last.
sys.path.append(sys.path.pop(0))

import argparse
import os
from pathlib import Path

import numpy as np

from anny_body import People, Unusable
from anny_clothes import Wardrobe
from anny_pose import Interpenetration, random_kind, random_pose, skinned

GROUP = "biped-anny"
ATTEMPTS = 12
RECIPE = 1  # of what a seed gives; raise it with every change


def main():
    options = parse_options()
    folder = options.out / "people"
    print("loading anny", flush=True)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        maker = Maker(options.seed, options.dressed)
        names = [f"anny_{options.seed}_{i:04}" for i in range(options.count)]
        made = 0
        for i, name in enumerate(names):
            made += make_one(maker, i, folder / f"{name}.ply")
            if (i + 1) % 20 == 0 or i + 1 == len(names):
                print(f"{i + 1} of {len(names)} people, {made} made now", flush=True)
        if maker.touching:
            print(f"note: {maker.touching} of them have limbs inside other parts; no better pose was found", flush=True)
        write_whole(options.out / "dataset.toml", manifest(names).encode())
    except (Unusable, OSError) as problem:
        sys.exit(f"anny.py: {problem}")
    print(f"wrote {options.out / 'dataset.toml'}: {len(names)} shapes, {len(names) - len(names) // 10} for training")


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="the dataset's folder; made where missing")
    parser.add_argument("--count", type=int, default=400, help="number of people (default 400)")
    parser.add_argument("--seed", type=int, default=0, help="start of the random numbers (default 0)")
    parser.add_argument("--dressed", type=float, default=0.0, help="share of dressed people, 0 to 1 (default 0)")
    options = parser.parse_args()
    if options.count < 1 or options.seed < 0:
        parser.error("--count must be at least 1 and --seed at least 0")
    if not 0.0 <= options.dressed <= 1.0:
        parser.error("--dressed is a share, from 0 to 1")
    return options


class Maker:
    """Makes person i of a seed, whatever was made before."""

    def __init__(self, seed, dressed):
        self.seed, self.dressed = seed, dressed
        self.people = People()
        self.wardrobe = Wardrobe(self.people)
        self.contact = Interpenetration(self.people.skeleton, self.people.weights, self.people.faces)
        self.touching = 0

    def recipe(self, i):
        """What a file was made from, to be compared before it is kept."""
        made = f"recipe {RECIPE} anny {self.people.version} seed {self.seed} person {i} dressed {self.dressed:g}"
        return f"fmnet anny.py {made}"

    def person(self, i):
        """Vertices [n, 3] of person i."""
        rng = np.random.default_rng([self.seed, i])
        kind, symmetric = random_kind(rng)
        body = self.people.random(rng, symmetric)
        fashion = np.random.default_rng([self.seed, i, 1])  # its own numbers: body and pose stay as they are undressed
        if fashion.uniform() < self.dressed:
            body = self.wardrobe.dressed(fashion, body, symmetric)
        for attempt in range(ATTEMPTS):
            pose = random_pose(rng, kind, symmetric, self.people.skeleton, body.heads, attempt)
            vertices = skinned(body, self.people.weights, self.people.skeleton, pose)
            if not self.contact.is_bad(vertices):
                return vertices
        self.touching += 1
        return vertices


def make_one(maker, i, path):
    """Writes person i unless it is there; whether it was made."""
    recipe = maker.recipe(i)
    if path.exists():
        if f"comment {recipe}\n".encode() not in path.read_bytes()[:512]:
            raise Unusable(f"{path} was made with other options or another version: give an empty folder")
        return False
    write_whole(path, ply(maker.person(i), maker.people.faces, recipe))
    return True


def ply(vertices, faces, comment):
    """A binary PLY file."""
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment {comment}\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    return header.encode() + vertices.astype("<f4").tobytes() + rows.tobytes()


def manifest(names):
    """`dataset.toml`: every tenth person is for validation."""
    lines = ["# People made by anny.py; the meshes are CC0.", "format = 1"]
    for i, name in enumerate(names):
        split = "validation" if i % 10 == 9 else "train"
        lines += ["", "[[shape]]", f'name = "{name}"', f'mesh = "people/{name}.ply"']
        lines += [f'group = "{GROUP}"', f'split = "{split}"']
    return "\n".join(lines) + "\n"


def write_whole(path, content):
    """Writes a file whole or not at all."""
    partial = path.with_name(path.name + ".part")
    partial.write_bytes(content)
    os.replace(partial, path)


if __name__ == "__main__":
    main()
