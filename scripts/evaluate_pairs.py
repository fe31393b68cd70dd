#!/usr/bin/env python3
"""Matches a list of pairs with fmnet-infer and evaluates the maps: mean geodesic error x 100, share exact, share within 0.05.

    scripts/evaluate_pairs.py PAIRS --meshes FOLDER --out FOLDER [--corres FOLDER] [-- options of fmnet-infer match ...]

PAIRS holds two names a line, without extension. Ground truth is `identity`, or with --corres the .vts files of that folder.
Figures are given for all pairs and, where names end in a number, for those within and across subjects of ten poses (FAUST).
Needs nothing but Python 3 and fmnet-infer (on the PATH, or named by FMNET_INFER).
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

INFER = os.environ.get("FMNET_INFER", "fmnet-infer")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", type=Path)
    parser.add_argument("--meshes", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--corres", type=Path)
    args, options = parser.parse_known_args()
    options = [o for o in options if o != "--"]
    pairs = [line.split()[:2] for line in args.pairs.read_text().splitlines() if line.strip()]
    files = {p.stem: p.resolve() for p in sorted(args.meshes.iterdir()) if p.suffix in {".ply", ".off", ".obj", ".glb"}}
    args.out.mkdir(parents=True, exist_ok=True)
    listing = args.out / "pairs.txt"
    listing.write_text("".join(f"{files[s]}\t{files[t]}\n" for s, t in pairs))
    subprocess.run([INFER, "batch", listing, "--out", args.out, "--quiet", *options], check=True)
    results = [(s, t, evaluate(args, files, s, t)) for s, t in pairs]
    report("all", results)
    if all(name[-3:].isdigit() for pair in pairs for name in pair):
        same = [r for r in results if int(r[0][-3:]) // 10 == int(r[1][-3:]) // 10]
        report("same subject", same)
        report("across subjects", [r for r in results if r not in same])


def evaluate(args, files, source, target):
    truth = "identity"
    if args.corres:
        truth = f"{args.corres}/{source}.vts,{args.corres}/{target}.vts"
    command = [INFER, "evaluate", args.out / f"{source}__{target}.txt", "--source", files[source]]
    command += ["--target", files[target], "--ground-truth", truth, "--json", "--quiet"]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(output)["maps"][0]["summary"]


def report(name, results):
    if not results:
        return
    mean = lambda key: sum(r[2][key] for r in results) / len(results)
    print(
        f"{name}: {len(results)} pairs, mean error x 100 {100 * mean('mean'):.2f}, exact {100 * mean('exact'):.1f} %, "
        f"within 0.05 {100 * mean('within_005'):.1f} %"
    )


if __name__ == "__main__":
    sys.exit(main())
