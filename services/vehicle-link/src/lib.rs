//! MAVLink to the autopilot: state, commands, guidance in formation, fail-safes
