//! Missions, formation slots, assignment, dispatch plans.
//!
//! Reads `vehicle/*/state` and `rig/*/sea-state`, serves `mission/command`; writes `plan`, `mission/{mission}/state` and
//! `event`, and asks vehicles to release their payload. Units are SI, places are metres north and east of the fleet's origin, headings are clockwise from true north.
//!
//! A mission surveys one point, waits for a safe verdict and for approval, sends one follower beside the leader, clears the
//! spot, lets the follower land there, and lets its payload go if it carries one:
//!
//! `waiting → transit → assessing → awaiting_approval → approved → joining → clearing → landing → releasing → completed`
//!
//! and from each of these to `paused` and back, to `aborted`, and to `failed`.
//!
//! **Invariant:** unknown is never safe. A follower is sent, and cleared to descend, only on a verdict that is safe, fresh,
//! measured near the spot and entirely since the leader settled over it.
//!
//! **Invariant:** a transition and a generation are stored before anyone hears of them. If they cannot be stored the service
//! ends, its plans lapse, and the vehicles fly their fail-safe.
//!
//! **Invariant:** generations strictly increase over the planner's whole life. At most one planner has the store.
//!
//! **Invariant:** every phase ends, in time if by nothing else.
//!
//! **Invariant:** a mission whose follower carries a payload completes only when the vehicle has confirmed its release, or a person has said
//! to go on without.
//!
//! **Invariant:** nothing under [`core`] knows the bus, the clock or the disk.
//!
//! What a restart forgets: who was heard and what was measured (both are heard again within seconds), for how long a phase has
//! lasted, and which followers failed to join. A paused mission stays paused.

mod actor;
pub mod config;
pub mod core;
pub mod store;

pub use actor::run;
pub use config::Config;
