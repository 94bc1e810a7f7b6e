"""What a MAVSDK 4 script asks a vehicle that stands on the ground."""

import asyncio
import json
from functools import partial
from pathlib import Path

from facts import fact
from mavsdk.asyncio import MavsdkError
from mavsdk.asyncio.plugins.action import OrbitYawBehavior
from mavsdk.asyncio.plugins.component_metadata import ComponentMetadataAsync, MetadataType
from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync, MavlinkMessage
from mavsdk.asyncio.plugins.telemetry import TelemetryError
from mavsdk_drone import PATIENCE, Drone, until

SET_MESSAGE_INTERVAL, UNKNOWN = 511, 31_999  # MAV_CMD
SCALED_PRESSURE, WIND_COV = 29, 231  # messages that MAVSDK hears but has no function to ask for
AN_ORBIT = 10, 2, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER


async def identify(drone: Drone) -> None:
    """Tell what MAVSDK takes the vehicle for."""
    version = await InfoAsync(drone.system).get_version()
    fact(
        autopilot=(await drone.system.autopilot_type()).name,
        vehicle=(await drone.system.vehicle_type()).name,
        components=await drone.system.component_ids(),
        version=[version.flight_sw_major, version.flight_sw_minor],
    )


async def read_and_set_parameters(drone: Drone) -> None:
    """Read all, set an integer and a float, and have what is wrong refused."""
    param = drone.param
    everything = await param.get_all_params()
    fact(int_params=len(everything.int_params), float_params=len(everything.float_params))
    if drone.px4:
        an_int, whole, a_float, real = "COM_DL_LOSS_T", 20, "MPC_XY_CRUISE", 7.5
    else:
        an_int, whole, a_float, real = "RTL_ALT", 1200, "FENCE_RADIUS", 123.5
    await param.set_param_int(an_int, whole)
    await param.set_param_float(a_float, real)
    refusals = await answers_to(
        {
            "unknown": partial(param.get_param_int, "NO_SUCH_PARAM"),
            "wrong type": partial(param.set_param_int, a_float, 3),
        }
    )
    values = await param.get_param_int(an_int), await param.get_param_float(a_float)
    fact(param_set=[whole, real], param_got=values, param_refusals=refusals)


async def listen_to_everything(drone: Drone) -> None:
    """Subscribe to each stream there is, at 10 Hz where a rate can be asked for."""
    telemetry = drone.telemetry
    offers = {
        name.removeprefix("subscribe_"): getattr(telemetry, name)
        for name in dir(telemetry)
        if name.startswith("subscribe_") and name != "subscribe_status_text"
    }
    refused = {}
    for name in offers:
        if set_rate := getattr(telemetry, f"set_rate_{name}", None):
            try:
                await set_rate(10.0)
            except TelemetryError as error:
                refused[name] = error.result.name
    for number in (SCALED_PRESSURE, WIND_COV):
        await command(drone, SET_MESSAGE_INTERVAL, number, 100_000)

    async def hear(name: str) -> tuple[str, str | None]:
        patience = 5 if name in refused else PATIENCE  # nothing is expected of what was refused
        try:
            return name, str(await until(offers[name](), lambda value: True, patience))
        except TimeoutError:
            return name, None

    heard = dict(await asyncio.gather(*map(hear, offers)))
    fact(
        heard={name: value[:120] for name, value in heard.items() if value is not None},
        silent=sorted(name for name, value in heard.items() if value is None),
        rates_refused=refused,
    )


async def use_small_plugins(drone: Drone) -> None:
    """Ask once whatever else can be asked."""
    metadata, ftp = ComponentMetadataAsync(drone.system), FtpAsync(drone.system)

    async def parameter_metadata() -> int:
        await metadata.request_autopilot_component()
        updates = metadata.subscribe_metadata_available()
        found = await until(updates, lambda u: u.type == MetadataType.PARAMETER)
        return len(json.loads(found.json_metadata)["parameters"])

    async def download() -> str:
        async for _ in ftp.download("@PARAM/param.pck", ".", True):
            pass
        return Path("param.pck").read_bytes()[:2].hex()

    fact(
        answers=await answers_to(
            {
                "origin": drone.telemetry.get_gps_global_origin,
                "product": InfoAsync(drone.system).get_product,
                "files": partial(ftp.list_directory, "/"),
                "download": download,
                "upload": partial(ftp.create_directory, "/new"),
                "logs": LogFilesAsync(drone.system).get_entries,
                "metadata": parameter_metadata,
                "return altitude": drone.action.get_return_to_launch_altitude,
                "orbit": partial(drone.action.do_orbit, *AN_ORBIT, *drone.home, 500),
                "unknown command": partial(command, drone, UNKNOWN),
            }
        )
    )


async def answers_to(questions: dict) -> dict[str, str]:
    """Return the answer to each question, or the name of the result that refuses it."""
    answers = {}
    for name, ask in questions.items():
        try:
            answers[name] = str(await ask())
        except MavsdkError as error:
            answers[name] = error.result.name
    return answers


async def command(drone: Drone, number: int, *params: float) -> int:
    """Send a COMMAND_LONG past all plug-ins; return the MAV_RESULT."""
    fields = {"target_system": 1, "target_component": 1, "command": number, "confirmation": 0}
    fields |= {f"param{i}": p for i, p in enumerate((*params, *(0,) * (7 - len(params))), 1)}
    message = MavlinkMessage("COMMAND_LONG", 245, 190, 1, 1, json.dumps(fields))
    ack = await MavlinkDirectAsync(drone.system).send_command(message)
    return json.loads(ack.fields_json)["result"]
