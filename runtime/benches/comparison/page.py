"""The page with the tables, and the plots."""

import json
import textwrap

from . import chart, environment, stages

COMMAND = ["pip install -r runtime/benches/peers/requirements.txt", "python runtime/benches/compare.py"]
WIDTH = 118
#: Lines that begin so are no prose, and stay as they are.
NOT_PROSE = ("|", "#", "!", "- ")


def write(out, figures, run):
    """Writes benchmarks.md, and the plots and all figures to the folder benchmarks."""
    folder = out / "benchmarks"
    folder.mkdir(parents=True, exist_ok=True)
    plots = {name: content for name, content in plotted(figures) if content}
    for name, content in plots.items():
        (folder / f"{name}.svg").write_text(content)
    (folder / "figures.json").write_text(json.dumps(figures, indent=1) + "\n")
    (out / "benchmarks.md").write_text("\n".join(map(wrapped, page(figures, run, plots))) + "\n")


def wrapped(line):
    if line.startswith(NOT_PROSE):
        return line
    return "\n".join(textwrap.wrap(line, WIDTH, break_long_words=False, break_on_hyphens=False))


def page(figures, run, plots):
    quick = ["This was a trial run with `--quick`: one repetition, small sizes.", ""] if run.quick else []
    lines = [
        "# Benchmarks", "",
        "Every figure on this page was measured in one run of one command, the second of these, ours and the peers' on the same data:", "",
        "```sh", *COMMAND, "```", "",
        "`--help` explains its options. Seconds are wall-clock, the least of several runs where a run is short; memory is the largest resident "
        "size of the process, which includes the inputs; 1 MB is 10^6 bytes. The ratio is ours over the peer's: below 1 ours is faster. The last column "
        "of a table says how far the two results agree.", "",
        f"Machine: {run.machine()}.", "", *quick,
    ]  # fmt: skip
    left_out = [name for name in stages.NAMES if all(figure["bench"] != name for figure in figures)]
    if left_out:
        lines += [f"Left out of this run (`--only`): {', '.join(left_out)}.", ""]
    for heading, reasons in (("Skipped:", run.skipped), ("Failed:", run.failed)):
        if reasons:
            lines += [heading, "", *[f"- {reason}" for reason in reasons], ""]
    short = summary(figures, run)
    if short:
        lines += ["## In short", "", *short, ""]
    lines += matching(figures, plots) + batches(figures) + sizes_of_files(figures)
    for name, stage in stages.BENCHES.items():
        chosen = [figure for figure in figures if figure["bench"] == name]
        if chosen:
            peer = f", `runtime/benches/peers/{name}.py`" if stage.peer else ""
            lines += [f"## {stage.title}", "", stage.about, "", f"`cargo bench --workspace --bench {name}`{peer}", ""]
            lines += comparison(chosen) + [""] + picture(plots, name, f"{stage.title} over the number of vertices")
    return lines[:-1] if lines[-1] == "" else lines


def matching(figures, plots):
    """The sections of `fmnet-infer match`: whole pairs, then each stage of the cold ones."""
    pairs = [figure for figure in figures if figure["bench"] == "match" and "state" in figure]
    lines = []
    if pairs:
        lines = ["## A pair, from files to the map", ""]
        lines += [
            "`fmnet-infer match source.ply target.ply -o map.txt`, with its defaults, as a process of its own: reading, all stages, writing. Two "
            "generated people in different poses, each triangulated on its own; what has more than 15000 vertices is decimated, matched and "
            "taken to the full meshes. Cached: with `--cache DIR` and both shapes in it.", "",
        ]  # fmt: skip
        lines += table(
            ["vertices", "cold s", "CPU s", "MB", "cached s", "CPU s", "MB"],
            [[number(n), *costs(pairs, n, "cold"), *costs(pairs, n, "cached")] for n in sizes(pairs)],
        )
        doubtful = sorted({number(figure["vertices"]) for figure in pairs if figure["ways"] > 1}, key=int)
        if doubtful:
            lines += ["", f"The first map of {', '.join(doubtful)} vertices was doubtful; the seconds are those of all ways that were tried."]
        lines += ["", *picture(plots, "match", "Seconds of a pair over the number of vertices")]
        lines += picture(plots, "memory", "Peak memory over the number of vertices")
        cold = {figure["vertices"]: figure["stages"] for figure in pairs if figure["state"] == "cold"}
        names = stage_names(cold)
        lines += [
            "Seconds of every stage of the cold pairs. Source and target are processed side by side; of the two the slower one is told.", "",
        ]  # fmt: skip
        rows = [[name, *[seconds(cold[n].get(name)) for n in cold]] for name in names]
        lines += table(["stage", *[chart.short(n) for n in cold]], rows)
        lines += ["", *picture(plots, "stages", "Seconds of every stage over the number of vertices")]
    return lines


def batches(figures):
    """All pairs of some shapes, by threads."""
    found = [figure for figure in figures if figure["bench"] == "batch"]
    if not found:
        return []
    shapes, pairs = found[0]["shapes"], found[0]["pairs"]
    rows = [[str(f["threads"]), f"{f['pairs_per_second']:.3g}", seconds(f["seconds"]), memory(f)] for f in found]
    return [
        "## Many pairs", "",
        f"`fmnet-infer batch pairs.txt --out maps --effort low`: all {pairs} pairs of {shapes} generated people of 2000 vertices, from "
        "files to maps, nothing cached before.", "",
        *table(["threads", "pairs a second", "s", "MB"], rows), "",
    ]  # fmt: skip


def sizes_of_files(figures):
    """What users fetch, and how long it takes to start."""
    names = {
        "fmnet-infer": "the program `fmnet-infer`; start", "fmnet-train": "the program `fmnet-train`; start",
        "wheel": "the Python wheel; `import fmnet`", "page": "the page in the browser, without its examples, not compressed",
    }  # fmt: skip
    found = [figure for figure in figures if figure["bench"] == "size"]
    if not found:
        return []
    rows = [[names[f["case"]], f"{f['bytes'] / 1e6:.1f}", seconds(f.get("seconds"))] for f in found]
    return ["## Sizes and starts", "", *table(["", "MB", "s"], rows), ""]


def summary(figures, run):
    """The sentence that the README has too, nothing where a size was not measured."""
    pairs = {(f["state"], f["vertices"]): f for f in figures if f["bench"] == "match" and "state" in f}
    wanted = [("cold", 6890), ("cached", 6890), ("cold", 200_000), ("cold", 1_000_000)]
    if any(key not in pairs for key in wanted):
        return []
    small, cached, large, scan = (rounded(pairs[key]["seconds"]) for key in wanted)
    of_large, of_scan = (rounded(pairs[key]["peak_mb"] / 1000) for key in wanted[2:])
    return [
        f"On {run.cores} cores ({plain(environment.processor())}) two people of 6890 vertices take {small} s from files to map, {cached} s "
        f"with both shapes in the cache; two of 200000 vertices {large} s and {of_large} GB, two scans of a million {scan} s and "
        f"{of_scan} GB."
    ]


def plain(processor):
    """Its name without the marks of trade."""
    for mark in ("(R)", "(TM)", " Processor"):
        processor = processor.replace(mark, "")
    return " ".join(processor.split())


def rounded(value):
    """Two significant digits."""
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}" if value >= 1 else f"{value:.2f}"


def comparison(figures):
    """A table of ours beside the peers, a row for each peer."""
    ours = fastest(figure for figure in figures if "peer" not in figure)
    peers = {}
    for figure in figures:
        if "peer" in figure:
            peers.setdefault((figure["case"], figure["threads"]), []).append(figure)
    with_peers = bool(peers)
    rows = []
    for figure in ours:
        if "error" in figure:
            continue
        first = [what(figure), number(figure.get("vertices")), str(figure["threads"]), seconds(figure["seconds"]), memory(figure)]
        beside = peers.get((figure["case"], figure["threads"]), [])
        for peer in beside or [None]:
            rows.append(first + (against(figure, peer) if with_peers else []))
    heads = ["", "vertices", "threads", "s", "MB"] + (["peer", "its s", "its MB", "ratio", "agreement"] if with_peers else [])
    lines = table(heads, rows)
    errors = [figure for figure in ours if "error" in figure]
    if errors:
        rows = [
            [figure["case"].split("-")[2], f"{100 * figure['wrong']:.0f} %", f"{figure['error_decimated']:.2f}", f"{figure['error']:.2f}"]
            for figure in errors
        ]
        lines += ["", "Mean geodesic error over sqrt(area), times 100:", ""]
        lines += table(["", "wrong matches", "of the decimated map", "of the full map"], rows)
    return lines


def fastest(figures):
    """Of the figures of one case on so many threads the fastest."""
    found = {}
    for figure in figures:
        key = (figure["case"], figure["threads"])
        if key not in found or figure.get("seconds", 0) < found[key].get("seconds", 0):
            found[key] = figure
    return list(found.values())


def against(figure, peer):
    if peer is None:
        return ["", "", "", "", ""]
    agreement = peer["agreement"] if peer["agrees"] is not False else f"**differs**: {peer['agreement']}"
    ratio = f"{figure['seconds'] / peer['seconds']:.2f}"
    return [peer["peer"], seconds(peer["seconds"]), memory(peer), ratio, agreement]


def what(figure):
    """A case in words."""
    bench, *rest = figure["case"].split("-")
    if bench == "eigen":
        return f"k = {figure['k']}"
    if bench == "nearest":
        return f"k = {figure['k']}, {'noisy' if figure['noise'] else 'no noise'}"
    words = [word for word in rest if word != str(figure.get("vertices"))]
    return " ".join(words) or bench


def plotted(figures):
    """The plots by name; None where a plot would have less than two places."""
    pairs = [figure for figure in figures if figure["bench"] == "match" and "state" in figure]
    states = ("cold", "cached")
    for name, title, label, key in (
        ("match", "A pair, from files to the map", "seconds", "seconds"),
        ("memory", "Peak memory of a pair", "MB", "peak_mb"),
    ):
        lines = [(state, [(f["vertices"], f[key]) for f in pairs if f["state"] == state]) for state in states]
        yield name, plot(title, label, lines)
    cold = {figure["vertices"]: figure["stages"] for figure in pairs if figure["state"] == "cold"}
    lines = [(name, [(n, cold[n][name]) for n in cold if cold[n].get(name, 0) > 0]) for name in stage_names(cold)]
    yield "stages", plot("Stages of a cold pair", "seconds", lines)
    for name, stage in stages.BENCHES.items():
        if name in ("mesh", "eigen", "shot", "nearest"):
            yield name, plot(stage.title, "seconds", bench_lines(figures, name))


def bench_lines(figures, name):
    """For each kind of case on all threads, where there is one on all, the seconds of ours and of the peers."""
    chosen = [figure for figure in figures if figure["bench"] == name]
    by_case = {figure["case"]: figure for figure in chosen if "peer" not in figure}
    threads = max((figure["threads"] for figure in chosen), default=1)
    lines = {}
    for figure in chosen:
        if figure["threads"] == threads and figure["case"] in by_case:
            ours = by_case[figure["case"]]
            kind = "k to 200" if name == "eigen" else what(ours).split(", ")[-1]
            if name == "eigen" and ours["k"] > 200:
                continue
            line = lines.setdefault(f"{figure.get('peer', 'fmnet').split(', ten')[0]}, {kind}", {})
            n = ours["vertices"]
            # Of several k at one size the smallest.
            line[n] = min(figure["seconds"], line.get(n, float("inf")))
    return [(line, list(points.items())) for line, points in lines.items()]


def plot(title, label, lines):
    if len({x for _, points in lines for x, _ in points}) < 2:
        return None
    return chart.svg(title, "vertices", label, lines)


def picture(plots, name, words):
    return [f"![{words}](benchmarks/{name}.svg)", ""] if plots.get(name) else []


def stage_names(cold):
    """Stages in the order in which they run."""
    return list(dict.fromkeys(name for stages_of_pair in cold.values() for name in stages_of_pair))


def sizes(pairs):
    return sorted({figure["vertices"] for figure in pairs})


def costs(pairs, n, state):
    found = [figure for figure in pairs if figure["vertices"] == n and figure["state"] == state]
    if not found:
        return ["", "", ""]
    return [seconds(found[0]["seconds"]), seconds(found[0]["cpu_seconds"]), memory(found[0])]


def seconds(value):
    if value is None:
        return ""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}" if value >= 1e-4 else "0"


def memory(figure):
    return f"{figure['peak_mb']:.0f}" if figure.get("peak_mb") else ""


def number(value):
    return "" if value is None else str(value)


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]
