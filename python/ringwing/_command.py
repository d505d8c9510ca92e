"""Flies with the command ``ringwing``, which starts a process for each part of a run."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

from ._native import FlightError, ScenarioError

#: Exit codes of ``ringwing run`` that come with a summary: passed, failed, violated.
_FLOWN = (0, 1, 3)
#: The exit code for a wrong scenario or wrong arguments.
_WRONG = 2


def find_command() -> str:
    """Finds the command ``ringwing``: the one that the environment variable ``RINGWING`` names, or else the one on the path."""
    named = os.environ.get("RINGWING")
    found = shutil.which(named or "ringwing")
    if found is None:
        where = f"RINGWING={named} names no program" if named else "it is not on the path"
        raise FlightError(
            f"the command ringwing starts the processes of a flight, and {where}: build it with `cargo build --release` and set "
            "RINGWING to target/release/ringwing, or fly with simulated=True"
        )
    return found


def fly_processes(
    scenario: str, keys: list[tuple[str, str]], faults: list[str], out: Path, *, record: bool
) -> tuple[dict[str, Any], Path | None]:
    """Flies with real processes; returns the summary and the run's folder."""
    words = [find_command(), "run", scenario, "--json", "--out", os.fspath(out)]
    for key, value in keys:
        words += ["--set", f"{key}={value}"]
    for fault in faults:
        words += ["--fault", fault]
    if not record:
        words.append("--no-record")
    code, text, errors = _call(words)
    if code == _WRONG:
        raise ScenarioError(_message(errors))
    if code not in _FLOWN or not text:
        raise FlightError(_message(errors) or f"the command ended with exit code {code} and said nothing")
    summary: dict[str, Any] = json.loads(text)
    log = summary["log"]
    return summary, None if log is None else Path(log).parent


def _call(words: list[str]) -> tuple[int, str, str]:
    # Ignore the user's ``ringwing.toml``: otherwise a flight with processes could differ from the same flight in the simulation.
    environment = {**os.environ, "RINGWING_CONFIG": ""}
    child = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        text, errors = child.communicate()
    except KeyboardInterrupt:
        # A terminal sends Ctrl-C to the child as well, but a notebook does not. A second signal changes nothing.
        child.send_signal(signal.SIGINT)
        child.communicate()
        raise
    return child.returncode, text, errors


def _message(errors: str) -> str:
    lines = [line.removeprefix("error: ") for line in errors.splitlines() if not line.startswith("warning:")]
    return "\n".join(lines).strip()
