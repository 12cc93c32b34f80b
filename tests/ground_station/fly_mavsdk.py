#!/usr/bin/env python3
"""Flies a simulated vehicle with MAVSDK, which knows nothing of Halcyon, and checks that it behaves as ArduCopter does.

    fly_mavsdk.py --connect tcpout://127.0.0.1:5760 [--json]

Prints what it measured; exits 0 when every check holds, 1 when one does not, 2 when it found no vehicle.
"""

import argparse
import asyncio
import json
import math
import sys

from mavsdk.asyncio import Autopilot, ComponentType, Configuration, Mavsdk, MavsdkConnectionError, Vehicle
from mavsdk.asyncio.plugins.action import ActionAsync, ActionError, RelayCommand
from mavsdk.asyncio.plugins.geofence import Circle, FenceType, GeofenceAsync, GeofenceData, Point, Polygon
from mavsdk.asyncio.plugins.gripper import GripperAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.mission_raw import MissionItem, MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync, PositionNedYaw, VelocityNedYaw
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import FlightMode, LandedState, TelemetryAsync

# Metres in a degree of latitude.
DEGREE_M = 111_195.0
# The mission protocol's numbers.
FRAME_RELATIVE_INT = 6
WAYPOINT, LAND, TAKEOFF, RALLY_POINT = 16, 21, 22, 5100
MISSION, RALLY = 0, 2


class Failed(Exception):
    """A check that does not hold."""


def check(what, holds, found=""):
    if not holds:
        raise Failed(f"{what}: {found}")


class Watch:
    """The latest of every kind of telemetry that was asked for, and waits with a bound."""

    def __init__(self, telemetry):
        self.telemetry = telemetry
        self.latest = {}
        self.texts = []
        self.changed = asyncio.Event()
        self.tasks = []

    def start(self, *kinds):
        for kind in kinds:
            self.tasks.append(asyncio.create_task(self.follow(kind)))

    async def follow(self, kind):
        async for value in getattr(self.telemetry, f"subscribe_{kind}")():
            self.latest[kind] = value
            if kind == "status_text":
                self.texts.append(value.text)
            self.changed.set()

    async def until(self, what, done, seconds):
        async def wait():
            while not done(self.latest):
                self.changed.clear()
                await self.changed.wait()

        try:
            await asyncio.wait_for(wait(), seconds)
        except asyncio.TimeoutError:
            latest = {kind: str(value) for kind, value in self.latest.items()}
            raise Failed(f"{what}: not within {seconds} s; {latest}; last texts {self.texts[-4:]}") from None

    def place(self):
        position = self.latest["position_velocity_ned"].position
        return (position.north_m, position.east_m, position.down_m)

    async def stop(self):
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


def kept_s():
    """Seconds since the loop began."""
    return asyncio.get_running_loop().time()


def near(place, wanted, within_m):
    return math.dist(place, wanted) < within_m


async def autopilot_type(system, within_s=10.0):
    """MAVSDK finds a system by its first heartbeat, which may be the companion's; what autopilot it has it knows by the autopilot's own."""
    for _ in range(int(within_s / 0.1)):
        if await system.autopilot_type() == Autopilot.ARDUPILOT:
            break
        await asyncio.sleep(0.1)
    return await system.autopilot_type()


async def ready(system, watch, figures):
    check("it is ArduPilot", await autopilot_type(system) == Autopilot.ARDUPILOT)
    check("it is a multicopter", await system.vehicle_type() == Vehicle.MULTICOPTER)
    version = await InfoAsync(system).get_version()
    figures["firmware"] = f"{version.flight_sw_major}.{version.flight_sw_minor}.{version.flight_sw_patch}"
    for rate in ("position", "velocity_ned", "position_velocity_ned", "landed_state", "distance_sensor", "scaled_imu"):
        await getattr(watch.telemetry, f"set_rate_{rate}")(10.0)
    for rate in ("health", "home", "battery", "gps_info"):
        await getattr(watch.telemetry, f"set_rate_{rate}")(2.0)
    watch.start("health", "home", "position", "velocity_ned", "position_velocity_ned", "landed_state", "armed", "flight_mode")
    watch.start("status_text", "battery", "gps_info", "scaled_imu", "distance_sensor", "in_air")
    start = kept_s()

    def healthy(latest):
        health = latest.get("health")
        return health and health.is_global_position_ok and health.is_home_position_ok and health.is_armable

    await watch.until("a good position", healthy, 90)
    figures["ready_s"] = round(kept_s() - start, 1)
    await watch.until("battery, satellites, IMU", lambda latest: {"battery", "gps_info", "scaled_imu"} <= latest.keys(), 10)
    down_mps2 = watch.latest["scaled_imu"].acceleration_frd.down_m_s2
    check("gravity is felt upwards", abs(down_mps2 + 9.8) < 0.3, down_mps2)
    check("there are satellites", watch.latest["gps_info"].num_satellites > 5)


async def parameters(system, figures):
    param = ParamAsync(system)
    before = await param.get_param_float("WPNAV_SPEED")
    await param.set_param_float("WPNAV_SPEED", 500.0)
    check("a parameter is set", await param.get_param_float("WPNAV_SPEED") == 500.0)
    await param.set_param_float("WPNAV_SPEED", before)
    await param.set_param_int("GRIP_ENABLE", 1)
    check("a whole parameter is set", await param.get_param_int("GRIP_ENABLE") == 1)
    everything = await param.get_all_params()
    figures["parameters"] = len(everything.float_params) + len(everything.int_params)
    check("all parameters are listed", figures["parameters"] > 60, figures)


async def payload(system, action):
    await GripperAsync(system).grab(1)
    await GripperAsync(system).release(1)
    try:
        await action.set_relay(0, RelayCommand.ON)
        raise Failed("a relay that is not there was set")
    except ActionError:
        pass
    await ParamAsync(system).set_param_int("RELAY1_FUNCTION", 1)
    await action.set_relay(0, RelayCommand.ON)


async def fly(system, watch, figures):
    action = ActionAsync(system)
    await payload(system, action)
    await guided(action)
    await action.set_takeoff_altitude(5.0)
    await action.arm()
    await watch.until("armed", lambda latest: latest["armed"], 5)
    start = kept_s()
    await action.takeoff()
    await watch.until("5 m up", lambda latest: latest["position"].relative_altitude_m > 4.8, 20)
    await watch.until("in the air", lambda latest: latest["landed_state"] == LandedState.IN_AIR, 10)
    figures["take_off_s"] = round(kept_s() - start, 1)
    home = watch.latest["home"]

    # Places on the map are gone to.
    there = (home.latitude_deg + 20.0 / DEGREE_M, home.longitude_deg)
    start = kept_s()
    await action.goto_location(*there, home.absolute_altitude_m + 7.0, 90.0)

    def arrived(latest):
        position = latest["position"]
        return abs(position.latitude_deg - there[0]) * DEGREE_M < 0.5 and abs(position.relative_altitude_m - 7.0) < 0.5

    await watch.until("the place", arrived, 40)
    figures["transit_s"] = round(kept_s() - start, 1)
    if "distance_sensor" in watch.latest:
        low, height = watch.latest["distance_sensor"].current_distance_m, watch.latest["position"].relative_altitude_m
        figures["range_error_m"] = round(low - height, 2)
        check("the rangefinder sees the water", abs(low - height) < 1.0, figures)

    await action.hold()
    await watch.until("HOLD", lambda latest: latest["flight_mode"] == FlightMode.HOLD, 5)
    held = watch.place()
    await asyncio.sleep(5)
    figures["hold_drift_m"] = round(math.dist(watch.place(), held), 3)
    check("it holds", figures["hold_drift_m"] < 1.5, figures)
    await offboard(system, watch, figures)
    start = kept_s()
    await action.land()
    await watch.until("LAND", lambda latest: latest["flight_mode"] == FlightMode.LAND, 5)
    await watch.until("disarmed on the water", lambda latest: not latest["armed"], 60)
    figures["land_s"] = round(kept_s() - start, 1)
    await watch.until("on the ground", lambda latest: latest["landed_state"] == LandedState.ON_GROUND, 5)


async def offboard(system, watch, figures):
    """Setpoints, as MAVSDK streams them."""
    setpoints = OffboardAsync(system)
    north, east, down = watch.place()
    place = (north - 8.0, east + 6.0, down + 1.0)
    await setpoints.set_position_ned(PositionNedYaw(*place, 0.0))
    await setpoints.start()
    check("setpoints are flown in GUIDED", await setpoints.is_active())
    await watch.until("the setpoint", lambda _: near(watch.place(), place, 0.5), 30)
    await setpoints.set_velocity_ned(VelocityNedYaw(0.0, -2.0, 0.0, 0.0))
    await asyncio.sleep(5)
    velocity = watch.latest["velocity_ned"]
    figures["velocity_error_mps"] = round(math.hypot(velocity.north_m_s, velocity.east_m_s + 2.0), 3)
    check("the velocity is flown", figures["velocity_error_mps"] < 0.5, figures)
    await setpoints.stop()
    await watch.until("HOLD after setpoints", lambda latest: latest["flight_mode"] == FlightMode.HOLD, 5)


def item(seq, command, north_m, height_m, home, mission_type=MISSION):
    place = (round((home.latitude_deg + north_m / DEGREE_M) * 1e7), round(home.longitude_deg * 1e7))
    return MissionItem(seq, FRAME_RELATIVE_INT, command, int(seq == 0), 1, 0.0, 0.0, 0.0, 0.0, *place, height_m, mission_type)


async def transfers(system, watch, figures):
    """Fence, rally points and mission: up, down, the same. Returns the mission's landing."""
    home = watch.latest["home"]

    def corner(north_m, east_m):
        scale = DEGREE_M * math.cos(math.radians(home.latitude_deg))
        return Point(home.latitude_deg + north_m / DEGREE_M, home.longitude_deg + east_m / scale)

    square = Polygon([corner(*place) for place in ((90, 90), (90, -90), (-90, -90), (-90, 90))], FenceType.INCLUSION)
    rock = Circle(corner(60, 60), 5.5, FenceType.EXCLUSION)
    fence = GeofenceAsync(system)
    await fence.upload_geofence(GeofenceData([square], [rock]))
    back = await fence.download_geofence()
    check("the fence has its shapes", (len(back.polygons), len(back.circles)) == (1, 1))
    # MAVSDK takes 10⁻⁷ degrees; ours were not whole ones.
    for sent, read in zip(square.points + [rock.point], back.polygons[0].points + [back.circles[0].point]):
        off_deg = max(abs(sent.latitude_deg - read.latitude_deg), abs(sent.longitude_deg - read.longitude_deg))
        check("the fence comes back", off_deg < 1.1e-7, off_deg)
    check("the circle comes back", back.circles[0].radius == 5.5 and back.circles[0].fence_type == FenceType.EXCLUSION)

    raw = MissionRawAsync(system)
    rally = [item(0, RALLY_POINT, 10.0, 6.0, home, RALLY)]
    await raw.upload_rally_points(rally)
    found = await raw.download_rallypoints()
    check("the rally point comes back", [(point.x, point.y, point.z) for point in found] == [(rally[0].x, rally[0].y, 6.0)])

    items = [item(0, WAYPOINT, 0.0, 0.0, home), item(1, TAKEOFF, 0.0, 5.0, home), item(2, WAYPOINT, 15.0, 6.0, home),
             item(3, LAND, 5.0, 0.0, home)]
    await raw.upload_mission(items)
    found = await raw.download_mission()
    figures["mission_items"] = len(found)
    check("the mission comes back", [(one.command, one.x, one.y, one.z) for one in found[1:]]
          == [(one.command, one.x, one.y, one.z) for one in items[1:]], [str(one) for one in found])
    return items[-1]


async def armed_again(action, watch):
    """After a landing: ArduCopter does not arm in LAND, nor in BRAKE, which is MAVSDK's hold."""
    for leave in (None, action.hold):
        if leave is not None:
            await leave()
        try:
            await action.arm()
            raise Failed("it armed in a mode that it may not")
        except ActionError:
            pass
    await guided(action)
    await action.arm()
    await watch.until("armed", lambda latest: latest["armed"], 5)


async def guided(action):
    """MAVSDK has no word for GUIDED, but its take-off begins with it, and is refused while the motors stand still."""
    try:
        await action.takeoff()
        raise Failed("it took off without being armed")
    except ActionError:
        pass


async def mission(system, watch, landing, figures):
    """The mission is flown to its end."""
    action, raw = ActionAsync(system), MissionRawAsync(system)
    await armed_again(action, watch)
    start = kept_s()
    await raw.start_mission()
    await watch.until("MISSION", lambda latest: latest["flight_mode"] == FlightMode.MISSION, 5)
    await watch.until("up", lambda latest: latest["position"].relative_altitude_m > 4.0, 30)
    await watch.until("down again", lambda latest: not latest["armed"], 90)
    figures["mission_s"] = round(kept_s() - start, 1)
    # Home is no measure: it was set anew where it armed.
    figures["mission_error_m"] = round(abs(watch.latest["position"].latitude_deg - landing.x * 1e-7) * DEGREE_M, 2)
    check("it lands where the mission ends", figures["mission_error_m"] < 1.5, figures)


async def return_home(system, watch, figures):
    action = ActionAsync(system)
    await action.set_return_to_launch_altitude(8.0)
    await action.set_takeoff_altitude(5.0)
    await armed_again(action, watch)
    await action.takeoff()
    await watch.until("5 m up", lambda latest: latest["position"].relative_altitude_m > 4.8, 20)
    home = watch.latest["home"]
    start = kept_s()
    await action.return_to_launch()
    await watch.until("RTL", lambda latest: latest["flight_mode"] == FlightMode.RETURN_TO_LAUNCH, 5)
    await watch.until("home", lambda latest: not latest["armed"], 90)
    figures["rtl_s"] = round(kept_s() - start, 1)
    position = watch.latest["position"]
    figures["rtl_error_m"] = round(abs(position.latitude_deg - home.latitude_deg) * DEGREE_M, 2)
    check("RTL comes home", figures["rtl_error_m"] < 1.5, figures)


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
            await ready(system, watch, figures)
            await parameters(system, figures)
            await fly(system, watch, figures)
            landing = await transfers(system, watch, figures)
            await mission(system, watch, landing, figures)
            await return_home(system, watch, figures)
        finally:
            await watch.stop()
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcpout://127.0.0.1:5760", help="as MAVSDK writes it")
    parser.add_argument("--json", action="store_true", help="print one object")
    options = parser.parse_args()
    figures = {}
    try:
        status = asyncio.run(run(options, figures))
    except Exception as failure:  # noqa: BLE001 every refusal of MAVSDK's has its own class
        print(f"FAILED: {type(failure).__name__}: {failure}\nso far: {figures}", file=sys.stderr)
        return 1
    if status == 0:
        print(json.dumps(figures) if options.json else "\n".join(f"{name} {value}" for name, value in figures.items()))
    return status


if __name__ == "__main__":
    sys.exit(main())
