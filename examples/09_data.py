"""09: a run as data: pandas, polars and Rerun's dataframes on what is in its folder.

`python examples/09_data.py RUN`, with the folder of a run; without one, a short one is flown first.
Needs `pip install pandas polars "rerun-sdk[catalog]"`; what is not installed is left out, and said.
docs/data.md says what every column is.
"""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path


def fly() -> Path:
    """Fly a short run and return its folder."""
    ports = [word for port in ("--gcs-udp", "--api-udp", "--tcp") for word in (port, "0")]
    command = [sys.executable, "-m", "mavherd", "run", "one-quad", "--json", *ports]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    return Path("runs") / json.loads(done.stdout)["run_id"]


def with_pandas(run: Path) -> None:
    """Print how far and how fast each robot went, and what happened when."""
    import pandas as pd

    states = pd.read_parquet(run / "states.parquet")
    speed = (states.v_east_m_s**2 + states.v_north_m_s**2 + states.v_up_m_s**2) ** 0.5
    table = states.assign(speed=speed).groupby("robot", observed=True)
    print(table.agg(rows=("time_s", "size"), highest_m=("up_m", "max"), fastest=("speed", "max")))
    events = pd.read_parquet(run / "events.parquet")
    print(events[events.kind == "phase"][["time_s", "vehicle", "text"]].to_string(index=False))


def with_polars(run: Path) -> None:
    """Print how well the attitude followed its command, while the motors ran."""
    import polars as pl

    states = pl.scan_parquet(run / "states.parquet").filter(
        pl.col("roll_command_rad").is_not_null()
    )
    roll = pl.arctan2(
        2 * (pl.col("qw") * pl.col("qx") + pl.col("qy") * pl.col("qz")),
        1 - 2 * (pl.col("qx") ** 2 + pl.col("qy") ** 2),
    )
    error = (roll - pl.col("roll_command_rad")).abs().degrees()
    print(states.group_by("robot").agg(roll_error_deg=error.mean()).collect())


def with_rerun(run: Path) -> None:
    """Print where the recording has the first robot, as a dataframe."""
    import rerun as rr

    name = json.loads((run / "robots.json").read_text())[0]["name"]
    with rr.server.Server(host="127.0.0.1", datasets={"runs": [str(run / "run.rrd")]}) as server:
        client = server.client()  # to be kept: queries fail once it is gone
        poses = client.get_dataset("runs").filter_contents([f"/world/robots/{name}"])
        frame = poses.reader(index="sim_time").to_pandas()
    place = f"/world/robots/{name}:Transform3D:translation"
    print(frame[["sim_time", place]].dropna().tail(3).to_string(index=False))


def main(arguments: list[str]) -> None:
    """Print what each package makes of a run."""
    run = Path(arguments[0]) if arguments else fly()
    print(f"law {json.loads((run / 'report.json').read_text())['law']}, {run}")
    if find_spec("pandas"):
        with_pandas(run)
    if find_spec("polars"):
        with_polars(run)
    if find_spec("datafusion") and (run / "run.rrd").exists():
        with_rerun(run)
    for package, name in (("pandas", "pandas"), ("polars", "polars"), ("datafusion", "rerun")):
        if not find_spec(package):
            print(f"{name} is left out: pip install pandas polars 'rerun-sdk[catalog]'")


if __name__ == "__main__":
    main(sys.argv[1:])
