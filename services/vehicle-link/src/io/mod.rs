//! The autopilot's end of the service: sockets and serial ports.

pub mod link;
