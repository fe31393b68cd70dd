#!/usr/bin/env python3
"""Measures every stage of fmnet beside its peers, in one run on one machine, and writes a page with tables and plots.

    python runtime/benches/compare.py              # all of it: docs/benchmarks.md and docs/benchmarks/*.svg
    python runtime/benches/compare.py --quick --out /tmp/benchmarks

It builds the programs and the benches, runs each bench and its peer on the same data, runs `fmnet-infer match` as a user would,
cold and with a cache, from 1K to 1M vertices, and `fmnet-infer batch` on all pairs of twenty shapes. The peers run in the
Python that runs this: `pip install -r runtime/benches/peers/requirements.txt` installs them, and PyTorch is used where it is
there. A peer that is not installed is skipped, and the page says so. Where a peer's result differs from ours, or a program of
ours fails, the exit status is 1.

Needs Rust and Python 3.9 or newer (3.11 for the pinned packages), Linux or macOS, about 8 GB of memory, and no research data. On
2 cores it takes about 20 minutes after the build; nothing else should run meanwhile.
"""

import argparse
import pathlib
import shutil
import signal
import sys
import tempfile
import time

from comparison import environment, matching, page, sizes, stages

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: What measures the stages that are no bench.
MEASURES = {"match": matching.measure, "batch": matching.measure_batch, "size": sizes.measure}


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=pathlib.Path, default=ROOT / "docs", metavar="DIR",
        help="where benchmarks.md and the folder benchmarks are written (default: docs of the repository)",
    )  # fmt: skip
    parser.add_argument(
        "--only", type=lambda text: text.split(","), default=list(stages.NAMES), metavar="STAGE,...",
        help=f"measure only these: {', '.join(stages.NAMES)}",
    )  # fmt: skip
    parser.add_argument(
        "--quick", action="store_true", help="small sizes and one repetition, about 2 minutes: to see that it works"
    )
    parser.add_argument("--no-peers", action="store_true", help="measure fmnet alone")
    parser.add_argument("--dry-run", action="store_true", help="print the commands, run nothing")
    chosen = parser.parse_args()
    unknown = [name for name in chosen.only if name not in stages.NAMES]
    if unknown:
        parser.error(f"there is no stage {unknown[0]}; choose from {', '.join(stages.NAMES)}")
    return chosen


def main():
    chosen = arguments()
    # So that the child is stopped and the temporary files go away.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    started = time.monotonic()
    run = environment.Run(ROOT, chosen.quick, chosen.dry_run)
    run.build()
    if not chosen.no_peers:
        run.find_peers()
    figures = []
    with tempfile.TemporaryDirectory(prefix="fmnet-benchmarks-") as scratch:
        for name in chosen.only:
            folder = pathlib.Path(scratch) / name
            folder.mkdir()
            begun = time.monotonic()
            figures += MEASURES.get(name, stages.measure)(run, name, folder)
            shutil.rmtree(folder, ignore_errors=True)
            print(f"{name}: {time.monotonic() - begun:.0f} s", file=sys.stderr)
    if chosen.dry_run:
        return 0
    page.write(chosen.out, figures, run)
    disagreeing = [figure for figure in figures if figure.get("agrees") is False]
    for figure in disagreeing:
        print(f"DISAGREES: {figure['case']} with {figure['peer']}: {figure['agreement']}", file=sys.stderr)
    print(f"{chosen.out / 'benchmarks.md'} written; {time.monotonic() - started:.0f} s")
    for line in page.summary(figures, run):
        print(line)
    return 1 if disagreeing or run.failed else 0


if __name__ == "__main__":
    sys.exit(main())
