//! The flight recorder: everything on the bus to MCAP, and replay
