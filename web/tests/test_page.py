"""What a visitor does with the page, in headless Chromium."""

import base64
import json
import re
import struct

import numpy as np
import pytest
from conftest import DEMO


def drop(page, files, onto="body"):
    """Drops files as a file manager does."""
    contents = [[file.name, base64.b64encode(file.read_bytes()).decode()] for file in files]
    transfer = page.evaluate_handle(
        """contents => {
          const transfer = new DataTransfer();
          for (const [name, text] of contents)
            transfer.items.add(new File([Uint8Array.from(atob(text), c => c.charCodeAt(0))], name));
          return transfer;
        }""",
        contents,
    )
    page.dispatch_event(onto, "drop", {"dataTransfer": transfer})


def wait_for_map(page):
    page.wait_for_selector("#result:visible, #error:visible")
    assert not page.is_visible("#error"), page.inner_text("#error")


def download(page, name, folder):
    with page.expect_download() as started:
        page.click(f'#downloads a[download="{name}"]')
    path = folder / name
    started.value.save_as(path)
    return path


def vertices_of(path):
    """Vertices, [n, 3], of an OFF file or of a binary PLY file of doubles or floats."""
    data = path.read_bytes()
    if data[:3] == b"OFF":
        words = data.split()
        return np.array(words[4 : 4 + 3 * int(words[1])], dtype=float).reshape(-1, 3)
    head, body = data.split(b"end_header\n", 1)
    n = int(re.search(rb"element vertex (\d+)", head)[1])
    properties = re.findall(rb"property (\w+) (\w+)", head.split(b"element face")[0])
    kinds = {b"float": "<f4", b"float32": "<f4", b"double": "<f8", b"float64": "<f8", b"uchar": "u1"}
    table = np.frombuffer(body, dtype=[(name.decode(), kinds[kind]) for kind, name in properties], count=n)
    return np.stack([table[axis] for axis in "xyz"], axis=1).astype(float)


def same_but_for_ties(ours, theirs, target):
    """Two maps agree where nothing is on the edge: nearly everywhere, and elsewhere by neighbours."""
    ours, theirs = np.loadtxt(ours, dtype=int), np.loadtxt(theirs, dtype=int)
    assert ours.shape == theirs.shape
    points = vertices_of(target)
    extent = np.ptp(points, axis=0).max()
    differ = np.flatnonzero(ours != theirs)
    assert len(differ) < 0.01 * len(ours), f"{len(differ)} of {len(ours)} differ"
    apart = np.linalg.norm(points[ours[differ]] - points[theirs[differ]], axis=1) / extent
    assert (apart < 0.05).all(), apart.max()


def colours_of_glb(path):
    data = path.read_bytes()
    assert data[:4] == b"glTF"
    length = struct.unpack_from("<I", data, 12)[0]
    scene = json.loads(data[20 : 20 + length])
    return scene["accessors"][scene["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]["count"]


def test_the_demo_pair(page, site, program, tmp_path):
    page.click("#demo")
    wait_for_map(page)
    summary = page.inner_text("#summary")
    assert "2400 of 2400 vertices" in summary and "mean error to expect" in summary, summary
    assert page.locator("#stages li").count() > 5
    expected = tmp_path / "expected.txt"
    program("match", *DEMO, "-o", expected, "-o", tmp_path / "expected.csv")
    same_but_for_ties(download(page, "map.txt", tmp_path), expected, DEMO[1])
    ours, theirs = (np.genfromtxt(path, delimiter=",", skip_header=2) for path in
                    (download(page, "map.csv", tmp_path), tmp_path / "expected.csv"))
    assert ours.shape == theirs.shape and np.abs(ours[:, 2] - theirs[:, 2]).mean() < 0.01
    assert colours_of_glb(download(page, "pair.glb", tmp_path)) == 4800
    # The viewer draws, and shows the doubt by a key.
    frame = page.frame_locator("#viewer")
    assert frame.locator("canvas").get_attribute("aria-label").startswith("source.ply and target.ply")
    frame.locator("canvas").press("d")
    assert frame.locator("#doubt").get_attribute("aria-pressed") == "true"
    assert all(url.startswith((site, "blob:" + site.rstrip("/"), "data:", "about:")) for url in page.asked), page.asked


def test_dropped_files_give_the_map_of_the_program(page, program, faust, tmp_path):
    drop(page, faust)
    page.click("#match")
    wait_for_map(page)
    expected = tmp_path / "expected.txt"
    program("match", *faust, "-o", expected)
    same_but_for_ties(download(page, "map.txt", tmp_path), expected, faust[1])


def test_each_shape_has_its_place(page, tmp_path):
    drop(page, [DEMO[1]], '.shape[data-side="target"]')
    assert page.inner_text("#target-name").startswith("target.ply")
    assert page.is_disabled("#match")
    drop(page, [DEMO[0]])
    assert page.inner_text("#source-name").startswith("source.ply")
    assert page.is_enabled("#match")


def test_a_damaged_file_gives_its_message_and_the_next_match_works(page, tmp_path):
    damaged = tmp_path / "damaged.ply"
    damaged.write_bytes(DEMO[0].read_bytes()[:9000])
    drop(page, [damaged, DEMO[1]])
    page.click("#match")
    page.wait_for_selector("#error:visible")
    assert re.match(r"damaged\.ply, (byte|line) \d+: .+; .+", page.inner_text("#error")), page.inner_text("#error")
    assert page.is_hidden("#result")
    page.click("#demo")
    wait_for_map(page)
    assert page.is_hidden("#error")


@pytest.mark.parametrize(
    "name, content, message",
    [("empty.obj", b"", "the file is empty"), ("page.ply", b"<!doctype html>", "this is a web page"),
     ("none.obj", b"v 0 0 0\n", "none.obj"), ("what.bin", b"\1\2\3\4", "this format is not known")],
)  # fmt: skip
def test_what_is_no_mesh_is_said(page, tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    drop(page, [DEMO[0], tmp_path / name])
    page.click("#match")
    page.wait_for_selector("#error:visible")
    assert message in page.inner_text("#error")


def test_warnings_are_shown(page, tmp_path):
    misnamed = tmp_path / "source.obj"
    misnamed.write_bytes(DEMO[0].read_bytes())
    drop(page, [misnamed, DEMO[1]])
    page.click("#match")
    page.wait_for_selector("#warnings:visible")
    assert "source.obj: the name is that of an OBJ file, but the content is PLY" in page.inner_text("#warnings")


def test_a_match_can_be_cancelled(page):
    page.click("#demo")
    page.wait_for_selector("#stages:visible")
    page.click("#cancel")
    assert page.inner_text("#status") == "Cancelled."
    assert page.is_enabled("#match") and page.is_hidden("#result")


def test_a_file_beyond_the_limit_is_refused_unread(page):
    page.evaluate("choose('source', new File([new Uint8Array(257e6)], 'huge.ply')); choose('target', chosen.source)")
    page.click("#match")
    assert "huge.ply has 257.0 MB" in page.inner_text("#error")


def test_the_keyboard_is_enough(page):
    reached = []
    for _ in range(12):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.id"))
        if reached[-1] == "demo":
            break
    assert reached[:2] == ["source", "target"] and reached[-1] == "demo", reached
    page.keyboard.press("Enter")
    wait_for_map(page)
    # A reader is taken to the result, and goes on from there to the files and to the viewer.
    assert page.evaluate("document.activeElement.id") == "result-title"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.download") == "map.txt"
    page.frame_locator("#viewer").locator("canvas").wait_for()
    for _ in range(6):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "viewer":
            break
    assert page.evaluate("document.activeElement.id") == "viewer"
    assert page.get_attribute("#status", "aria-live") == "polite"


def test_files_are_chosen_by_the_dialog_too(page):
    page.set_input_files("#source", DEMO[0])
    page.set_input_files("#target", DEMO[1])
    assert page.is_enabled("#match")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_window_does_not_scroll_sideways(page, scheme):
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": 400, "height": 800})
    page.click("#demo")
    wait_for_map(page)
    page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
