"""The page in headless Chromium, on a server that knows nothing else, and the program beside which its results are held."""

import functools
import http.server
import os
import shutil
import sys
import threading
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from program import program  # noqa: E402, F401
DIST = ROOT / "web" / "dist"
DEMO = [ROOT / "runtime" / "demo" / name for name in ("source.ply", "target.ply")]


@pytest.fixture(scope="session")
def site():
    """The address of the built page."""
    if not (DIST / "fmnet.wasm").exists():
        pytest.skip("no web/dist: build it with web/build.sh")

    class Handler(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=DIST))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


@pytest.fixture(scope="session")
def browser():
    """Chromium: that of the system or of FMNET_CHROMIUM, else Playwright's own."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    names = [os.environ.get("FMNET_CHROMIUM"), "chromium", "chromium-browser", "google-chrome"]
    path = next((found for name in names if name and (found := shutil.which(name))), None)
    with playwright.sync_playwright() as running:
        arguments = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        try:
            browser = running.chromium.launch(executable_path=path, args=arguments)
        except playwright.Error as error:
            pytest.skip(f"no Chromium: {error.message.splitlines()[0]}")
        yield browser
        browser.close()


@pytest.fixture
def page(browser, site):
    """The page in a new profile; whatever it asks of the network is in ``page.asked``, what goes wrong in it fails the test."""
    context = browser.new_context(viewport={"width": 1100, "height": 900}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(240_000)
    page.asked, problems = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.goto(site)
    yield page
    context.close()
    assert not problems, problems


@pytest.fixture(scope="session")
def faust():
    """Two people in different poses, of some 5000 vertices, from FMNET_DATA or the data beside the repository."""
    for data in filter(None, [os.environ.get("FMNET_DATA"), ROOT / ".." / "shared" / "data"]):
        files = [Path(data) / "faust" / "remeshed_5k" / f"tr_reg_{i}.off" for i in ("061", "074")]
        if all(file.exists() for file in files):
            return files
    pytest.skip("no FAUST (faust/remeshed_5k): name its folder in FMNET_DATA")
