"""Carries the landmarks of one specimen to every mesh of a folder.

    pip install ./python tqdm
    python examples/python/landmarks.py specimen.ply landmarks.txt specimens landmarks.csv

landmarks.txt has a vertex of specimen.ply a line, counted from 0. landmarks.csv gets a line for each mesh and landmark: the mesh,
the landmark, the vertex, and how far its match can be trusted, from 0 to 1.
"""

import argparse
import csv
import sys
from pathlib import Path

import fmnet
import numpy as np
from tqdm import tqdm

MESHES = {".ply", ".obj", ".off", ".stl", ".glb", ".gltf"}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("specimen")
    parser.add_argument("landmarks")
    parser.add_argument("folder")
    parser.add_argument("out", help=".csv")
    arguments = parser.parse_args()

    matcher = fmnet.Matcher()
    specimen = matcher.describe(arguments.specimen)
    landmarks = np.loadtxt(arguments.landmarks, dtype=int, ndmin=1)
    rows, failed = [], 0
    for path in tqdm(sorted(p for p in Path(arguments.folder).iterdir() if p.suffix.lower() in MESHES)):
        try:
            # From the specimen to the mesh: the match of a landmark is its vertex there.
            match = matcher.match(specimen, path)
        except (ValueError, OSError) as error:
            print(f"{path}: {error}", file=sys.stderr)
            failed += 1
            continue
        for number, landmark in enumerate(landmarks):
            rows.append([path.name, number, match.targets[landmark], f"{match.confidence[landmark]:.3f}"])
    with open(arguments.out, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["mesh", "landmark", "vertex", "confidence"])
        writer.writerows(rows)
    print(f"{len(rows)} landmarks written to {arguments.out}, {failed} meshes failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
