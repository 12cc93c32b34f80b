#!/usr/bin/env python3
"""Flies a simulated vehicle with pymavlink, which knows nothing of Halcyon, and checks that it behaves as ArduCopter does.

    fly_pymavlink.py --connect tcp:127.0.0.1:5760 [--speed 1] [--json]

Prints what it measured; exits 0 when every check holds, 1 when one does not, 2 when it could not connect. Times are the vehicle's
own (time since its boot), so that a simulation that runs faster is judged alike; --speed only scales how long this waits at most.
"""

import argparse
import json
import math
import os
import sys
import time

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import mavutil  # noqa: E402

M = mavutil.mavlink
POSITION_ONLY = 0b110111111000
VELOCITY_ONLY = 0b110111000111


class Failed(Exception):
    """A check that does not hold."""


class Ground:
    """A small ground station: one connection, the latest of every message, bounded waits."""

    def __init__(self, connect, speed):
        self.speed = speed
        self.link = mavutil.mavlink_connection(connect, source_system=255, source_component=190, retries=30)
        self.texts = []
        self.latest = {}

    def pump(self, wait_s=0.05):
        message = self.link.recv_match(blocking=True, timeout=wait_s)
        if message is None:
            return None
        kind = message.get_type()
        self.latest[kind] = message
        if kind == "STATUSTEXT":
            self.texts.append(message.text)
        return message

    def until(self, what, done, vehicle_s):
        """Pumps until `done(message)`, at most `vehicle_s` of the vehicle's time and some grace."""
        deadline = time.monotonic() + vehicle_s / self.speed + 5.0
        while time.monotonic() < deadline:
            message = self.pump()
            if message is not None and done(message):
                return message
        raise Failed(f"{what}: not within {vehicle_s} s; last texts {self.texts[-4:]}")

    def for_vehicle_s(self, seconds, each=lambda _: None):
        start = self.boot_s()
        deadline = time.monotonic() + seconds / self.speed * 3 + 10.0
        while self.boot_s() - start < seconds:
            if time.monotonic() > deadline:
                raise Failed(f"the vehicle's clock stands still at {self.boot_s():.1f} s")
            message = self.pump()
            if message is not None:
                each(message)

    def boot_s(self):
        position = self.latest.get("LOCAL_POSITION_NED")
        while position is None:
            self.until("a local position", lambda m: m.get_type() == "LOCAL_POSITION_NED", 30)
            position = self.latest["LOCAL_POSITION_NED"]
        return position.time_boot_ms * 1e-3

    def command(self, command, *params):
        params = list(params) + [0] * (7 - len(params))
        self.link.mav.command_long_send(self.link.target_system, 1, command, 0, *params)
        ack = self.until(f"an answer to command {command}", lambda m: m.get_type() == "COMMAND_ACK" and m.command == command, 10)
        return ack.result

    def accepted(self, command, *params):
        result = self.command(command, *params)
        check(f"command {command} is accepted", result == M.MAV_RESULT_ACCEPTED, f"{result}, texts {self.texts[-3:]}")

    def mode(self, name):
        number = self.link.mode_mapping()[name]
        self.accepted(M.MAV_CMD_DO_SET_MODE, M.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, number)
        self.until(f"mode {name}", lambda m: m.get_type() == "HEARTBEAT" and m.custom_mode == number, 5)

    def armed(self, wanted, vehicle_s):
        def done(message):
            return message.get_type() == "HEARTBEAT" and bool(message.base_mode & M.MAV_MODE_FLAG_SAFETY_ARMED) == wanted

        self.until("armed" if wanted else "disarmed", done, vehicle_s)

    def place(self):
        position = self.latest["LOCAL_POSITION_NED"]
        return (position.x, position.y, position.z)

    def target(self, mask, place=(0, 0, 0), velocity=(0, 0, 0)):
        self.link.mav.set_position_target_local_ned_send(
            0, self.link.target_system, 1, M.MAV_FRAME_LOCAL_NED, mask, *place, *velocity, 0, 0, 0, 0, 0
        )

    def param(self, name, value=None):
        if value is None:
            self.link.mav.param_request_read_send(self.link.target_system, 1, name.encode(), -1)
        else:
            self.link.mav.param_set_send(self.link.target_system, 1, name.encode(), value, M.MAV_PARAM_TYPE_REAL32)
        return self.until(f"parameter {name}", lambda m: m.get_type() == "PARAM_VALUE" and m.param_id == name, 5).param_value


def check(what, holds, found=""):
    if not holds:
        raise Failed(f"{what}: {found}")


def fly(ground, figures):
    link = ground.link
    heartbeat = link.wait_heartbeat(timeout=30)
    check("a heartbeat", heartbeat is not None, "none within 30 s")
    check("a quadrotor by ArduPilot", (heartbeat.type, heartbeat.autopilot) == (M.MAV_TYPE_QUADROTOR, M.MAV_AUTOPILOT_ARDUPILOTMEGA))
    for message, rate_hz in ((M.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20), (M.MAVLINK_MSG_ID_EKF_STATUS_REPORT, 4),
                             (M.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 4), (M.MAVLINK_MSG_ID_SIMSTATE, 20),
                             (M.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 20), (M.MAVLINK_MSG_ID_SYS_STATUS, 4)):
        ground.accepted(M.MAV_CMD_SET_MESSAGE_INTERVAL, message, 1e6 / rate_hz)

    # Refusals come with an answer.
    check("an unknown command is unsupported", ground.command(M.MAV_CMD_DO_ENGINE_CONTROL) == M.MAV_RESULT_UNSUPPORTED)
    check("no take-off while disarmed", ground.command(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == M.MAV_RESULT_FAILED)

    # Parameters, one by one and all.
    before = ground.param("WPNAV_SPEED")
    check("a parameter is set", ground.param("WPNAV_SPEED", 500) == 500)
    link.mav.param_request_list_send(link.target_system, 1)
    seen = set()

    def collect(message):
        if message.get_type() == "PARAM_VALUE" and message.param_index != 65535:
            seen.add(message.param_index)
        return message.get_type() == "PARAM_VALUE" and len(seen) == message.param_count

    ground.until("all parameters", collect, 20)
    figures["parameters"] = len(seen)
    ground.param("WPNAV_SPEED", before)

    # Ready, armed, up.
    needed = M.EKF_POS_HORIZ_ABS | M.EKF_ATTITUDE
    ground.until("a good position", lambda m: m.get_type() == "EKF_STATUS_REPORT" and m.flags & needed == needed, 90)
    figures["ready_s"] = round(ground.boot_s(), 1)
    ground.mode("GUIDED")
    ground.accepted(M.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    ground.armed(True, 5)
    start = ground.boot_s()
    home = ground.place()
    ground.accepted(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    ground.until("5 m up", lambda m: m.get_type() == "LOCAL_POSITION_NED" and home[2] - m.z > 4.8, 20)
    figures["take_off_s"] = round(ground.boot_s() - start, 1)
    ground.for_vehicle_s(3)

    # To a place, and hold it.
    place = (home[0] + 20, home[1] + 10, home[2] - 6)
    start = ground.boot_s()
    ground.target(POSITION_ONLY, place)
    ground.until("the place", lambda m: m.get_type() == "LOCAL_POSITION_NED" and math.dist(ground.place(), place) < 0.5, 40)
    figures["transit_s"] = round(ground.boot_s() - start, 1)
    ground.for_vehicle_s(6)
    errors = []
    ground.for_vehicle_s(10, lambda m: errors.append(math.dist(ground.place(), place)) if m.get_type() == "LOCAL_POSITION_NED" else None)
    figures["hold_mean_m"] = round(sum(errors) / len(errors), 3)
    figures["hold_max_m"] = round(max(errors), 3)
    check("it holds the place", figures["hold_max_m"] < 0.8, figures)

    # A velocity is flown while it is repeated, and dropped 3 s after.
    start = ground.boot_s()
    while ground.boot_s() - start < 5:
        ground.target(VELOCITY_ONLY, velocity=(0, -2, 0))
        ground.for_vehicle_s(0.2)
    velocity = ground.latest["LOCAL_POSITION_NED"]
    figures["velocity_error_mps"] = round(math.hypot(velocity.vx, velocity.vy + 2), 3)
    check("the velocity is flown", figures["velocity_error_mps"] < 0.5, figures)
    ground.for_vehicle_s(7)
    velocity = ground.latest["LOCAL_POSITION_NED"]
    check("the velocity is dropped", math.hypot(velocity.vx, velocity.vy) < 0.4, f"{velocity.vx} {velocity.vy}")

    # LOITER holds; LAND lands and disarms.
    ground.mode("LOITER")
    held = ground.place()
    ground.for_vehicle_s(5)
    figures["loiter_drift_m"] = round(math.dist(ground.place(), held), 3)
    check("LOITER holds", figures["loiter_drift_m"] < 1.5, figures)
    start = ground.boot_s()
    ground.mode("LAND")
    ground.armed(False, 60)
    figures["land_s"] = round(ground.boot_s() - start, 1)
    check("it says so", any("Disarming motors" in text for text in ground.texts), ground.texts[-4:])
    landed = M.MAV_LANDED_STATE_ON_GROUND
    ground.until("on the ground", lambda m: m.get_type() == "EXTENDED_SYS_STATE" and m.landed_state == landed, 5)

    # Off the water again and home by RTL.
    ground.mode("GUIDED")
    ground.param("RTL_ALT", 800)
    link.mav.command_int_send(link.target_system, 1, M.MAV_FRAME_GLOBAL_RELATIVE_ALT, M.MAV_CMD_DO_SET_HOME, 0, 0, 1, 0, 0, 0, 0, 0, 0)
    ground.until("home set", lambda m: m.get_type() == "COMMAND_ACK" and m.command == M.MAV_CMD_DO_SET_HOME, 5)
    home = ground.place()
    ground.accepted(M.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    ground.accepted(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5)
    ground.until("5 m up", lambda m: m.get_type() == "LOCAL_POSITION_NED" and home[2] - m.z > 4.6, 20)
    ground.for_vehicle_s(2)
    ground.target(POSITION_ONLY, (home[0] - 15, home[1], home[2] - 5))
    ground.for_vehicle_s(12)
    start = ground.boot_s()
    ground.mode("RTL")
    ground.armed(False, 120)
    figures["rtl_s"] = round(ground.boot_s() - start, 1)
    figures["rtl_error_m"] = round(math.dist(ground.place()[:2], home[:2]), 3)
    check("RTL comes home", figures["rtl_error_m"] < 1.5, figures)

    # What the estimator believed against SIMSTATE, the simulator's truth.
    believed, true = ground.latest["GLOBAL_POSITION_INT"], ground.latest["SIMSTATE"]
    north = (believed.lat - true.lat) * 1e-7 * 111_132
    east = (believed.lon - true.lng) * 1e-7 * 111_132 * math.cos(math.radians(believed.lat * 1e-7))
    figures["estimator_error_m"] = round(math.hypot(north, east), 3)
    check("the estimator is near the truth", figures["estimator_error_m"] < 3, figures)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp:127.0.0.1:5760", help="as pymavlink writes it")
    parser.add_argument("--speed", type=float, default=1.0, help="fleet seconds per wall second")
    parser.add_argument("--json", action="store_true", help="print one object")
    options = parser.parse_args()
    try:
        ground = Ground(options.connect, options.speed)
    except OSError as error:
        print(f"cannot connect to {options.connect}: {error}", file=sys.stderr)
        return 2
    figures = {}
    try:
        fly(ground, figures)
    except Failed as failure:
        print(f"FAILED: {failure}\nso far: {figures}", file=sys.stderr)
        return 1
    finally:
        ground.link.close()
    print(json.dumps(figures) if options.json else "\n".join(f"{name} {value}" for name, value in figures.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
