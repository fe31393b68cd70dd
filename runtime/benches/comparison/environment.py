"""Building, the peers, running a command and saying what it cost, and what machine this is."""

import importlib.metadata
import importlib.util
import json
import os
import pathlib
import platform
import shlex
import subprocess
import sys
import tempfile
import time

PEERS = pathlib.Path("runtime/benches/peers")


class Run:
    """One run of the comparison: the programs built, the Python of the peers, what was skipped and what failed."""

    def __init__(self, root, quick, dry_run):
        self.root = root
        self.quick = quick
        self.dry_run = dry_run
        self.executables = {}
        self.python = None
        self.skipped = []
        self.failed = []
        self.cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()

    def build(self):
        """Builds the programs and the benches, and finds out where they are."""
        for command in (
            ["cargo", "build", "--release", "--workspace", "--bins"],
            ["cargo", "bench", "--workspace", "--no-run", "--bench", "*"],
        ):
            self.say(command)
            if self.dry_run:
                continue
            command += ["--message-format", "json-render-diagnostics"]
            built = subprocess.run(command, cwd=self.root, stdout=subprocess.PIPE, text=True)
            if built.returncode != 0:
                sys.exit(f"error: {shlex.join(command[:4])} failed; see above")
            for line in built.stdout.splitlines():
                message = json.loads(line)
                if message.get("executable"):
                    self.executables[message["target"]["name"]] = message["executable"]

    def program(self, name):
        return self.executables.get(name, name)

    def find_peers(self):
        """The peers run in the Python that runs this, and each skips what is not installed there."""
        if importlib.util.find_spec("numpy") is None and not self.dry_run:
            self.skip(f"all peers: NumPy is not installed; pip install -r {PEERS / 'requirements.txt'}")
            return
        self.python = sys.executable

    def skip(self, reason):
        if reason not in self.skipped:
            print(f"skipped {reason}", file=sys.stderr)
            self.skipped.append(reason)

    def say(self, command, variables=None):
        """Shows a command as it could be typed in the repository."""
        words = [f"{name}={value}" for name, value in (variables or {}).items()]
        print(" ".join([*words, shlex.join(str(word) for word in command)]), file=sys.stderr, flush=True)

    def execute(self, command, variables=None):
        """Runs a command. Its output, as far as it came, and its wall seconds, CPU seconds and peak memory, None where it failed."""
        self.say([pathlib.Path(command[0]).name, *command[1:]], variables)
        if self.dry_run:
            return "", {"seconds": 0.0, "cpu_seconds": 0.0, "peak_mb": 0.0}
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            environment = {**os.environ, **(variables or {})}
            words = [str(word) for word in command]
            start = time.perf_counter()
            child = subprocess.Popen(words, cwd=self.root, stdout=out, stderr=err, env=environment)
            try:
                _, status, usage = os.wait4(child.pid, 0)
            except BaseException:
                child.kill()
                raise
            seconds = time.perf_counter() - start
            child.returncode = os.waitstatus_to_exitcode(status)
            out.seek(0)
            err.seek(0)
            output, messages = out.read(), err.read().strip().splitlines()
        is_peer = words[0] == self.python
        for line in messages:
            if line.startswith("skipped ") and is_peer:
                self.skip(line.removeprefix("skipped "))
        # Linux counts in KiB, macOS in bytes.
        unit = 1e-6 if sys.platform == "darwin" else 1024e-6
        cost = {"seconds": seconds, "cpu_seconds": usage.ru_utime + usage.ru_stime, "peak_mb": usage.ru_maxrss * unit}
        if child.returncode == 0:
            return output, cost
        reason = messages[-1] if messages else f"exit status {child.returncode}"
        if is_peer:
            self.skip(f"the rest of {words[1]}: {reason}")
        else:
            self.failed.append(f"{shlex.join([pathlib.Path(words[0]).name, *words[1:]])}: {reason}")
            print(f"FAILED {self.failed[-1]}", file=sys.stderr)
        return output, None

    def machine(self):
        """Cores, processor, memory and versions; nothing that names the machine."""
        versions = [subprocess.check_output(["rustc", "--version"], text=True).split(" (")[0]]
        if self.python:
            requirements = (self.root / PEERS / "requirements.txt").read_text().split()
            versions += [f"{name} {version}" for name in map(name_of, [*requirements, "torch"]) if (version := installed(name))]
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9
        return f"{self.cores} cores, {processor()}, {memory:.0f} GB of memory, {platform.system()}; {', '.join(versions)}"


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def name_of(requirement):
    return requirement.split("==")[0]


def installed(name):
    """The version of a package, None where it is not installed."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
