"""The page with the tables, and the plots."""

import json

from . import chart, stages

COMMAND = "python runtime/benches/compare.py"


def write(out, figures, run):
    """Writes benchmarks.md, and the plots and all figures to the folder benchmarks."""
    folder = out / "benchmarks"
    folder.mkdir(parents=True, exist_ok=True)
    plots = {name: content for name, content in plotted(figures) if content}
    for name, content in plots.items():
        (folder / f"{name}.svg").write_text(content)
    (folder / "figures.json").write_text(json.dumps(figures, indent=1) + "\n")
    (out / "benchmarks.md").write_text("\n".join(page(figures, run, plots)) + "\n")


def page(figures, run, plots):
    quick = ["This was a trial run with `--quick`: one repetition, small sizes.", ""] if run.quick else []
    lines = [
        "# Benchmarks", "",
        "Every figure on this page was measured in one run of one command, ours and the peers' on the same data:", "",
        "```sh", COMMAND, "```", "",
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
    lines += matching(figures, plots)
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
    starts = [figure for figure in figures if figure["case"] == "start"]
    lines = []
    if pairs:
        lines = ["## A pair, from files to the map", ""]
        lines += [
            "`fmnet-infer match source.ply target.ply -o map.txt`, with its defaults, as a process of its own: reading, all stages, ZoomOut, writing. "
            "Two generated people in different poses, each triangulated on its own; what has more than 15000 vertices is decimated, matched "
            "and upscaled. Cached: with `--cache DIR` and both shapes in it.", "",
        ]  # fmt: skip
        lines += table(
            ["vertices", "cold s", "CPU s", "MB", "cached s", "CPU s", "MB"],
            [[number(n), *costs(pairs, n, "cold"), *costs(pairs, n, "cached")] for n in sizes(pairs)],
        )
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
    for figure in starts:
        lines += [f"The program is {figure['bytes'] / 1e6:.1f} MB large and takes {1e3 * figure['seconds']:.1f} ms to start.", ""]
    return lines


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
    if bench == "step":
        return f"{' '.join(rest)}, {figure['points']} points"
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
