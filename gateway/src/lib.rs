//! REST mission API, live stream and dashboard.
//!
//! **Reads** everything that people want to see: vehicle states, sea states, surfaces, previews (only while someone looks),
//! missions, the plan, health, presence, events. **Writes** nothing: it only asks, by `mission/command` and
//! `vehicle/{vehicle}/command`, and passes the answer on.
//!
//! **Units:** SI inside, degrees in JSON; see [`api::dto`].
//!
//! **Invariants:** no domain logic, the planner and the vehicles decide. Memory is bounded, whatever comes over the bus or from
//! clients; no client can make another one, or the bus, wait; every request ends. A restart forgets all but what the bus keeps.

pub mod actor;
pub mod api;
pub mod app;
mod bus;
pub mod config;
pub mod core;
pub mod feed;
pub mod port;
pub mod server;

pub use actor::{bind, run, run_with};
pub use api::openapi::openapi_json;
pub use config::Config;
