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
        self.said_s = -math.inf

    def pump(self, wait_s=0.05):
        if time.monotonic() - self.said_s >= 1.0:
            # As every ground station; a relay over UDP learns from it where we are.
            self.said_s = time.monotonic()
            self.link.mav.heartbeat_send(M.MAV_TYPE_GCS, M.MAV_AUTOPILOT_INVALID, 0, 0, M.MAV_STATE_ACTIVE)
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


def items_of(link, mission_type, entries):
    """Items of the mission protocol from (command, param1, latitude, longitude, height)."""
    return [
        M.MAVLink_mission_item_int_message(
            link.target_system, 1, seq, M.MAV_FRAME_GLOBAL_RELATIVE_ALT, command, 0, 1, param1, 0, 0, 0,
            round(latitude * 1e7), round(longitude * 1e7), height, mission_type)
        for seq, (command, param1, latitude, longitude, height) in enumerate(entries)
    ]


def upload(ground, mission_type, items):
    """As the protocol's page has it: count, one item for each request, acknowledgement."""
    link = ground.link
    link.mav.mission_count_send(link.target_system, 1, len(items), mission_type)
    kinds = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
    for _ in range(2 * len(items) + 1):
        message = ground.until(
            f"an answer to an upload of type {mission_type}",
            lambda m: m.get_type() in kinds and m.mission_type == mission_type, 10)
        if message.get_type() == "MISSION_ACK":
            return message.type
        link.mav.send(items[message.seq])
    raise Failed("an upload never ends")


def download(ground, mission_type):
    link = ground.link
    link.mav.mission_request_list_send(link.target_system, 1, mission_type)
    count = ground.until("a count", lambda m: m.get_type() == "MISSION_COUNT" and m.mission_type == mission_type, 10).count
    found = []
    for seq in range(count):
        link.mav.mission_request_int_send(link.target_system, 1, seq, mission_type)
        found.append(ground.until(
            f"item {seq}",
            lambda m: m.get_type() == "MISSION_ITEM_INT" and m.seq == seq and m.mission_type == mission_type, 10))
    link.mav.mission_ack_send(link.target_system, 1, M.MAV_MISSION_ACCEPTED, mission_type)
    return found


def transfers(ground, figures):
    """Fence and rally points, up and down."""
    link = ground.link
    position = ground.latest["GLOBAL_POSITION_INT"]
    latitude, longitude = position.lat * 1e-7, position.lon * 1e-7
    vertex, rock = M.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, M.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
    corners = [(vertex, 5, latitude + north, longitude + east, 0)
               for north, east in ((2e-3, 2e-3), (2e-3, -2e-3), (0, -3e-3), (-2e-3, -2e-3), (-2e-3, 2e-3))]
    fence = items_of(link, M.MAV_MISSION_TYPE_FENCE, corners + [(rock, 12.5, latitude + 1e-3, longitude + 1e-3, 0)])
    rally = items_of(link, M.MAV_MISSION_TYPE_RALLY, [(M.MAV_CMD_NAV_RALLY_POINT, 0, latitude + 1e-3, longitude, 8)])
    for mission_type, items in ((M.MAV_MISSION_TYPE_FENCE, fence), (M.MAV_MISSION_TYPE_RALLY, rally)):
        check(f"items of type {mission_type} are taken", upload(ground, mission_type, items) == M.MAV_MISSION_ACCEPTED)
        key = lambda item: (item.command, item.param1, item.x, item.y, item.z)  # noqa: E731
        sent, read = [key(item) for item in items], [key(item) for item in download(ground, mission_type)]
        check(f"items of type {mission_type} come back", sent == read, f"{sent} {read}")
    check("FENCE_TOTAL counts them", ground.param("FENCE_TOTAL") == len(fence))
    # A fence of two corners is none.
    check("half a fence is refused", upload(ground, M.MAV_MISSION_TYPE_FENCE, fence[:2]) == M.MAV_MISSION_ERROR)
    link.mav.mission_clear_all_send(link.target_system, 1, M.MAV_MISSION_TYPE_RALLY)
    ground.until("cleared", lambda m: m.get_type() == "MISSION_ACK" and m.mission_type == M.MAV_MISSION_TYPE_RALLY, 5)
    check("rally points are cleared", download(ground, M.MAV_MISSION_TYPE_RALLY) == [])
    figures["fence_items"] = len(fence)


def synchronise(ground, figures):
    """TIMESYNC: our time comes back with the vehicle's, in nanoseconds since its boot."""
    trips = []
    for _ in range(10):
        sent_ns = time.monotonic_ns()
        ground.link.mav.timesync_send(0, sent_ns)
        answer = ground.until("TIMESYNC", lambda m: m.get_type() == "TIMESYNC" and m.ts1 == sent_ns, 5)
        trips.append((time.monotonic_ns() - sent_ns) * 1e-6)
        check("it is its time since boot", abs(answer.tc1 * 1e-9 - ground.boot_s()) < 1.0, f"{answer.tc1} {ground.boot_s()}")
    figures["timesync_ms"] = round(min(trips), 1)


def payload(ground):
    check("no gripper, no grip", ground.command(M.MAV_CMD_DO_GRIPPER, 1, 0) == M.MAV_RESULT_FAILED)
    ground.param("GRIP_ENABLE", 1)
    ground.param("SERVO9_FUNCTION", 28)
    for action, width_us in ((1, 1900), (0, 1100)):
        ground.accepted(M.MAV_CMD_DO_GRIPPER, 1, action)
        ground.accepted(M.MAV_CMD_REQUEST_MESSAGE, M.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW)
        check("the servo moves", ground.latest["SERVO_OUTPUT_RAW"].servo9_raw == width_us)


def sign(ground, figures):
    """A key for the vehicle: from then on it hears only what is signed with it, and signs what it says."""
    link, key = ground.link, bytes(range(32))
    link.mav.setup_signing_send(link.target_system, 1, list(key), 1)
    ground.for_vehicle_s(0.5)
    # pymavlink still sends without a signature, and takes what comes with one.
    link.mav.param_request_read_send(link.target_system, 1, b"WPNAV_SPEED", -1)
    silent_until = time.monotonic() + 1.0
    while time.monotonic() < silent_until:
        message = ground.pump()
        check("nothing unsigned is answered", message is None or message.get_type() != "PARAM_VALUE")
    seen = []
    link.setup_signing(key, sign_outgoing=True, allow_unsigned_callback=lambda _, message_id: seen.append(message_id) and False)
    check("a signed question is answered", ground.param("WPNAV_SPEED") > 0)
    ground.for_vehicle_s(2)
    check("everything it says is signed", not seen, seen[:5])
    check("an answer is signed", ground.latest["PARAM_VALUE"].get_signed())
    # No key again: with one the rest would prove less.
    link.mav.setup_signing_send(link.target_system, 1, [0] * 32, 0)
    link.disable_signing()
    ground.for_vehicle_s(0.5)
    check("without a key it hears all", ground.param("WPNAV_SPEED") > 0)
    figures["signed"] = True


def fly(ground, figures):
    link = ground.link
    heartbeat = link.wait_heartbeat(timeout=30)
    check("a heartbeat", heartbeat is not None, "none within 30 s")
    check("a quadrotor by ArduPilot", (heartbeat.type, heartbeat.autopilot) == (M.MAV_TYPE_QUADROTOR, M.MAV_AUTOPILOT_ARDUPILOTMEGA))
    for message, rate_hz in ((M.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20), (M.MAVLINK_MSG_ID_EKF_STATUS_REPORT, 4),
                             (M.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 4), (M.MAVLINK_MSG_ID_SIMSTATE, 20),
                             (M.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 20), (M.MAVLINK_MSG_ID_SYS_STATUS, 4),
                             (M.MAVLINK_MSG_ID_DISTANCE_SENSOR, 20), (M.MAVLINK_MSG_ID_ATTITUDE, 20)):
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
    transfers(ground, figures)
    synchronise(ground, figures)
    payload(ground)
    sign(ground, figures)
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

    if "DISTANCE_SENSOR" in ground.latest:
        sensor, lean = ground.latest["DISTANCE_SENSOR"], ground.latest["ATTITUDE"]
        low = sensor.current_distance * 0.01 * math.cos(lean.roll) * math.cos(lean.pitch)
        figures["range_error_m"] = round(low - (home[2] - ground.place()[2]), 2)
        check("it looks down", sensor.orientation == M.MAV_SENSOR_ROTATION_PITCH_270)
        # The water's waves and the barometer's wander lie between.
        check("the rangefinder sees the water", abs(figures["range_error_m"]) < 1.0, figures)

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
