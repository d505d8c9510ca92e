"""Shows a log in the rerun viewer, with a 3D view of the swarm and plots.

rerun decodes the log, but it does not know what is worth a look. This sends it a blueprint that says so, and what the views show. Needs the
package ``rerun-sdk`` 0.41 or newer::

    python3 examples/rerun/show.py runs/latest                     # opens the viewer
    python3 examples/rerun/show.py runs/latest --save flight.rrd   # for `rerun flight.rrd`, later or elsewhere
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

import ringwing

#: The plots: fields of ``/uav/.../state`` and their titles.
PLOTS = {
    "slot_error_m": "Distance from the slot (m)",
    "next_distance_m": "Distance to the next ring neighbour (m)",
    "speed_m_s": "Speed (m/s)",
    "turn_rate_rad_s": "Turn rate (rad/s)",
}
#: The colours of the UAVs, as in ringwing's other pictures. With more UAVs they repeat.
COLOURS = [(230, 159, 0), (86, 180, 233), (0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0), (204, 121, 167)]
#: UAVs that have lines of their own in the plots. Lines of more cover each other.
PLOTTED = 12
#: Where the eye is, seen from the leader, for a ring of this radius. Farther away, the ring is small; nearer, it does not fit.
EYE_M, RING_M = np.array([-130.0, -90.0, 110.0]), 40.0
#: Points of each path. More make the file larger; with fewer, turns become corners.
POINTS = 1000
#: The time of tick 0 in every log.
BEGIN = np.datetime64("2026-01-01T00:00:00", "ns")
#: The timeline of what rerun decodes from the log.
TIMELINE = "message_log_time"


def blueprint(log: ringwing.Log) -> rrb.Blueprint:
    """The 3D view, with the events below it and the plots beside it."""
    ring_m = float(log.metadata["run"].get("radius_m", RING_M))
    swarm = rrb.Spatial3DView(
        name="The swarm, following its leader",
        origin="/show/swarm",
        spatial_information=rrb.SpatialInformation(target_frame="leader"),
        eye_controls=rrb.EyeControls3D(position=EYE_M * ring_m / RING_M, look_target=[0, 0, 0], eye_up=[0, 0, 1]),
    )
    flight = rr.TimeRange(start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite())
    some = f": {PLOTTED} of {len(log.uavs)} UAVs" if len(log.uavs) > PLOTTED else ""
    plots = [
        rrb.TimeSeriesView(name=title + some, origin=f"/show/{field}", axis_x=rrb.TimeAxis(view_range=flight))
        for field, title in PLOTS.items()
    ]
    events = rrb.TextLogView(name="Events", origin="/log")
    left = rrb.Vertical(swarm, events, row_shares=[3, 1])
    return rrb.Blueprint(rrb.Horizontal(left, rrb.Vertical(*plots), column_shares=[3, 2]), collapse_panels=True)


def show_uav(uav: ringwing.Uav, is_named: bool) -> None:
    """An arrow that flies as the UAV does, its path, and its lines in the plots."""
    state, colour = uav.state, COLOURS[(uav.number - 1) % len(COLOURS)]
    name = f"uav_{uav.number:03}"
    # The transforms of the log place the frame; what is drawn in it moves with it.
    rr.log(f"/show/swarm/{name}", rr.CoordinateFrame(name), static=True)
    label = str(uav.number) if is_named else None
    arrow = rr.Arrows3D(vectors=[[12, 0, 0]], colors=colour, radii=1, labels=label)
    rr.log(f"/show/swarm/{name}", arrow, static=True)
    places = np.column_stack([state["x_m"], state["y_m"], 0 * state["x_m"]])
    path = places[np.isfinite(places).all(axis=1)][:: max(1, len(places) // POINTS)]
    rr.log(f"/show/swarm/paths/{name}", rr.CoordinateFrame("map"), static=True)
    rr.log(f"/show/swarm/paths/{name}", rr.LineStrips3D([path], colors=colour, radii=rr.Radius.ui_points(1)), static=True)
    if uav.number > PLOTTED:
        return
    # A UAV in its failsafe flies away, and its distances would flatten all other lines.
    is_flying = state["mode"] == "commanded"
    times = BEGIN + (state["time_s"] * 1e9).round().astype("timedelta64[ns]")
    for field in PLOTS:
        entity = f"/show/{field}/{name}"
        rr.log(entity, rr.SeriesLines(names=f"uav {uav.number}", colors=colour), static=True)
        values = np.where(is_flying, state[field], np.nan)
        rr.send_columns(entity, [rr.TimeColumn(TIMELINE, timestamp=times)], rr.Scalars.columns(scalars=values))


def show_world(log: ringwing.Log) -> None:
    """The leader, and the obstacles where they are at the start."""
    rr.log("/show/swarm/leader", rr.CoordinateFrame("leader"), static=True)
    rr.log("/show/swarm/leader", rr.Points3D([[0, 0, 0]], radii=3, colors=(255, 255, 255), labels="leader"), static=True)
    angles = np.linspace(0, 2 * np.pi, 65)
    circle = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    circles = [[*one["position_m"], 0] + one["radius_m"] * circle for one in log.scenario["obstacles"]]
    rr.log("/show/swarm/obstacles", rr.CoordinateFrame("map"), static=True)
    rr.log("/show/swarm/obstacles", rr.LineStrips3D(circles, colors=COLOURS[5]), static=True)


def main() -> None:
    arguments = argparse.ArgumentParser(description="Shows a log in the rerun viewer, with a 3D view of the swarm and plots.")
    arguments.add_argument("log", help="a run's folder, or the .mcap file in it")
    arguments.add_argument("--save", type=Path, metavar="FILE", help="write a file for rerun instead of opening the viewer")
    given = arguments.parse_args()
    log = ringwing.Log(given.log)
    rr.init("ringwing", spawn=given.save is None)
    if given.save:
        rr.save(given.save, default_blueprint=blueprint(log))
    else:
        rr.send_blueprint(blueprint(log))
    rr.log_file_from_path(log.path)
    # Dozens of names would hide the aircraft.
    is_named = len(log.uavs) <= PLOTTED
    for uav in log.uavs:
        show_uav(uav, is_named)
    show_world(log)


if __name__ == "__main__":
    main()
