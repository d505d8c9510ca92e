"""The example that shows a log in rerun, checked by rerun's own command."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import ringwing

SHOW = Path(__file__).parents[2] / "examples" / "rerun" / "show.py"


def test_a_log_is_shown_in_rerun_with_a_blueprint(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    run = ringwing.run("dropout", set={"time.duration_s": 40}, out=tmp_path)
    assert run.folder is not None
    file = tmp_path / "flight.rrd"
    saved = subprocess.run([sys.executable, str(SHOW), str(run.folder), "--save", str(file)], capture_output=True, text=True)
    assert saved.returncode == 0, saved.stderr
    rerun = [sys.executable, "-m", "rerun", "rrd"]
    verified = subprocess.run([*rerun, "verify", str(file)], capture_output=True, text=True)
    assert verified.returncode == 0, verified.stderr
    printed = subprocess.run([*rerun, "print", str(file)], capture_output=True, text=True).stdout
    # The blueprint, what rerun decodes by itself, and what the example adds.
    for text in ["Blueprint", "/view/", "/uav/006/state", "/tf", "/show/swarm/uav_006", "/show/slot_error_m/uav_006"]:
        assert text in printed, text
