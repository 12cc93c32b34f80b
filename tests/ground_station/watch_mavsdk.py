#!/usr/bin/env python3
"""Watches a vehicle in flight through a relay with MAVSDK, takes it over, and lands it.

    watch_mavsdk.py --connect tcpout://127.0.0.1:5790

Another program flies the vehicle. Nothing is asked of its streams: what the relay passes on must be enough. Exits 0 when every check
holds, 1 when one does not, 2 when it found no vehicle.
"""

import argparse
import asyncio
import json
import math
import sys

from mavsdk.asyncio import Autopilot, ComponentType, Configuration, Mavsdk, MavsdkConnectionError
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import FlightMode, LandedState, TelemetryAsync

from fly_mavsdk import Watch, autopilot_type, check


async def watched(system, watch, figures):
    check("it is ArduPilot's", await autopilot_type(system) == Autopilot.ARDUPILOT)
    version = await InfoAsync(system).get_version()
    figures["firmware"] = f"{version.flight_sw_major}.{version.flight_sw_minor}.{version.flight_sw_patch}"
    watch.start("position", "velocity_ned", "position_velocity_ned", "landed_state", "armed", "flight_mode", "health", "battery", "home")
    kinds = {"position", "position_velocity_ned", "landed_state", "armed", "flight_mode", "health", "battery", "home"}
    await watch.until("everything that is needed", lambda latest: kinds <= latest.keys(), 20)
    # Each of these is put together from several messages, and first told before all of them came. MAVSDK calls GUIDED OFFBOARD.
    for what, done in (
        ("armed", lambda latest: latest["armed"]),
        ("GUIDED", lambda latest: latest["flight_mode"] == FlightMode.OFFBOARD),
        ("in the air", lambda latest: latest["landed_state"] == LandedState.IN_AIR),
        ("a good position", lambda latest: latest["health"].is_global_position_ok),
        ("up", lambda latest: 4 < latest["position"].relative_altitude_m < 8),
        ("a known battery", lambda latest: 0 < latest["battery"].remaining_percent <= 100),
    ):
        await watch.until(what, done, 10)
    figures["height_m"] = round(watch.latest["position"].relative_altitude_m, 2)
    param = ParamAsync(system)
    before = await param.get_param_float("WPNAV_SPEED")
    await param.set_param_float("WPNAV_SPEED", before + 50)
    check("a parameter is set", await param.get_param_float("WPNAV_SPEED") == before + 50)
    await param.set_param_float("WPNAV_SPEED", before)
    everything = await param.get_all_params()
    figures["parameters"] = len(everything.float_params) + len(everything.int_params)


async def taken(system, watch, figures):
    """The pilot's word: nobody sets another mode afterwards."""
    action = ActionAsync(system)
    await action.hold()
    await watch.until("HOLD", lambda latest: latest["flight_mode"] == FlightMode.HOLD, 5)
    held = watch.place()
    for _ in range(30):
        await asyncio.sleep(0.2)
        check("HOLD stays", watch.latest["flight_mode"] == FlightMode.HOLD, watch.latest["flight_mode"])
    figures["drift_m"] = round(math.dist(watch.place(), held), 2)
    check("it holds its place", figures["drift_m"] < 3, figures)
    await action.land()
    await watch.until("LAND", lambda latest: latest["flight_mode"] == FlightMode.LAND, 5)
    await watch.until("disarmed", lambda latest: not latest["armed"], 60)


async def run(options, figures):
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        try:
            await mavsdk.add_any_connection(options.connect)
        except MavsdkConnectionError as error:
            print(f"cannot connect to {options.connect}: {error}", file=sys.stderr)
            return 2
        system = await mavsdk.first_autopilot(timeout_s=30.0)
        if system is None:
            print(f"no autopilot on {options.connect}", file=sys.stderr)
            return 2
        watch = Watch(TelemetryAsync(system))
        try:
            await watched(system, watch, figures)
            await taken(system, watch, figures)
        finally:
            await watch.stop()
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcpout://127.0.0.1:5790", help="as MAVSDK writes it")
    options = parser.parse_args()
    figures = {}
    try:
        status = asyncio.run(run(options, figures))
    except Exception as failure:  # noqa: BLE001 every refusal of MAVSDK's has its own class
        print(f"FAILED: {type(failure).__name__}: {failure}\nso far: {figures}", file=sys.stderr)
        return 1
    if status == 0:
        print(json.dumps(figures))
    return status


if __name__ == "__main__":
    sys.exit(main())
