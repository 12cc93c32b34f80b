//! The autopilot's end of the service: sockets and serial ports.

pub(crate) mod key;
pub mod link;
mod relay;
mod transport;
