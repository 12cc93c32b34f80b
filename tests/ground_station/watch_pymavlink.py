#!/usr/bin/env python3
"""Watches a vehicle in flight through a relay with pymavlink, and takes it over by LOITER.

    watch_pymavlink.py --connect udpout:127.0.0.1:14550

Another program flies the vehicle. Nothing is asked of its streams: what the relay passes on must be enough. Exits 0 when every check
holds, 1 when one does not, 2 when it could not connect.
"""

import argparse
import json
import math
import sys

from fly_pymavlink import Failed, Ground, M, check

# What any ground station needs to draw a vehicle.
NEEDED = {"HEARTBEAT", "GLOBAL_POSITION_INT", "SYS_STATUS", "GPS_RAW_INT", "BATTERY_STATUS", "EKF_STATUS_REPORT", "EXTENDED_SYS_STATE"}


def watch(ground, figures):
    link = ground.link

    def autopilot(message):
        return message.get_type() == "HEARTBEAT" and message.get_srcComponent() == M.MAV_COMP_ID_AUTOPILOT1

    heartbeat = ground.until("the autopilot's heartbeat", autopilot, 30)
    link.target_system, link.target_component = heartbeat.get_srcSystem(), 1
    check("it is ArduPilot's", heartbeat.autopilot == M.MAV_AUTOPILOT_ARDUPILOTMEGA)
    check("it flies in GUIDED", link.mode_mapping()["GUIDED"] == heartbeat.custom_mode, heartbeat.custom_mode)
    check("it is armed", bool(heartbeat.base_mode & M.MAV_MODE_FLAG_SAFETY_ARMED))
    ground.until("everything that is needed", lambda _: NEEDED <= ground.latest.keys(), 20)

    places = []
    ground.for_vehicle_s(4, lambda m: places.append((m.lat, m.lon, m.relative_alt)) if m.get_type() == "GLOBAL_POSITION_INT" else None)
    figures["position_hz"] = len(places) / 4
    check("positions come often", figures["position_hz"] > 5, figures)
    figures["height_m"] = places[-1][2] * 1e-3
    check("it is up", 4 < figures["height_m"] < 8, figures)

    # Questions go through, and their answers come back here.
    before = ground.param("WPNAV_SPEED")
    check("a parameter is set", ground.param("WPNAV_SPEED", before + 50) == before + 50)
    ground.param("WPNAV_SPEED", before)
    link.mav.param_request_list_send(link.target_system, 1)
    seen = set()

    def collect(message):
        if message.get_type() == "PARAM_VALUE" and message.param_index != 65535:
            seen.add(message.param_index)
        return message.get_type() == "PARAM_VALUE" and len(seen) == message.param_count

    ground.until("all parameters", collect, 20)
    figures["parameters"] = len(seen)
    ground.accepted(M.MAV_CMD_REQUEST_MESSAGE, M.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    check("it is 4.6", ground.latest["AUTOPILOT_VERSION"].flight_sw_version >> 16 == 0x0406)

    # The pilot's word: nobody sets another mode afterwards.
    ground.mode("LOITER")
    number = link.mode_mapping()["LOITER"]
    modes = set()
    ground.for_vehicle_s(6, lambda m: modes.add(m.custom_mode) if autopilot(m) else None)
    check("LOITER stays", modes == {number}, modes)
    start, held = places[-1], ground.latest["GLOBAL_POSITION_INT"]
    figures["drift_m"] = round(math.hypot(held.lat - start[0], held.lon - start[1]) * 1e-7 * 111_195, 2)
    check("it holds its place", figures["drift_m"] < 3, figures)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="udpout:127.0.0.1:14550", help="as pymavlink writes it")
    options = parser.parse_args()
    try:
        ground = Ground(options.connect, 1.0)
    except OSError as error:
        print(f"cannot connect to {options.connect}: {error}", file=sys.stderr)
        return 2
    figures = {}
    try:
        watch(ground, figures)
    except Failed as failure:
        print(f"FAILED: {failure}\nso far: {figures}", file=sys.stderr)
        return 1
    finally:
        ground.link.close()
    print(json.dumps(figures))
    return 0


if __name__ == "__main__":
    sys.exit(main())
