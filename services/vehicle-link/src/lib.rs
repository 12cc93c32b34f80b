//! MAVLink to the autopilot: state, commands, guidance in formation, fail-safes.
//!
//! Reads: dispatch plans, other vehicles' states, direct commands, the autopilot's MAVLink. Writes: this vehicle's state (10 Hz),
//! events on every change of activity and every fail-safe, and MAVLink for exactly one autopilot. SI inside; positions in the
//! fleet's local north-east-down frame; degrees and centimetres only in [`core::telemetry`] and [`core::encode`].
//!
//! | module | is |
//! |---|---|
//! | [`core::telemetry`] | MAVLink messages → vehicle state |
//! | [`core::frame`], [`core::signing`], [`core::version`] | MAVLink frames as bytes, their signatures, MAVLink 1 and 2 |
//! | [`core::timesync`], [`core::loss`] | the autopilot's clock and the round trip; which share of its frames is lost |
//! | [`core::identity`], [`core::mode`], [`core::px4`] | what flies the vehicle; ArduCopter's and PX4's modes; what PX4 wants otherwise |
//! | [`core::commands`] | the command protocol: retries, acknowledgements, typed refusals |
//! | [`core::transfers`], [`core::parameters`], [`core::items`] | parameters; missions, fences, rally points |
//! | [`core::payload`] | what holds the payload |
//! | [`core::guidance`], [`core::separation`], [`core::track`] | the slot, the way there, the distance to everyone |
//! | [`core::law`], [`core::observer`], [`core::inverse`] | the named laws, the leader's motion, the follower's own lag |
//! | [`core::intent`], [`core::continuity`] | the leader's own setpoint; places without their receivers' leaps |
//! | [`core::local`] | the autopilot's local frame, the only one in which it takes accelerations |
//! | `experiment` | the thesis's formation flights against the simulator, and many vehicles through bad radio; behind a feature of that name |
//! | [`core::interlock`], [`core::failsafe`], [`core::control`] | when not to; the table of fail-safes; the pilot |
//! | [`core::executor`] | reality made to match the newest plan or a direct command |
//! | [`io::link`] | sockets and serial ports that come back, and ground stations beside them |
//! | [`actor`] | the one task |
//!
//! **Invariant:** nothing under `core/` knows the bus, a socket or a clock; messages and states go in, setpoints, requests and
//! notes come out.
//! **Invariant:** no message is addressed to MAVLink system 0, and none leaves before the autopilot's heartbeat but our own.
//! **Invariant:** a mode that we didn't ask for is never changed back.

pub mod actor;
pub mod autopilot;
pub mod config;
pub mod core;
pub mod endpoint;
#[cfg(any(test, feature = "experiment"))]
pub mod experiment;
pub mod io;

pub use actor::run;
pub use config::Config;
