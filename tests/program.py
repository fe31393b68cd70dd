"""A pytest fixture that the tests of the Python package and of the page share."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def program():
    """Runs ``fmnet-infer``; skips where it was not built."""
    found = shutil.which(os.environ.get("FMNET_INFER") or ROOT / "target" / "release" / "fmnet-infer")
    if found is None:
        pytest.skip("no fmnet-infer: build it (cargo build --release --workspace --bin fmnet-infer) or name it in FMNET_INFER")

    def run(*arguments):
        done = subprocess.run([found, "--quiet", *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
