//! What the gateway knows: pure, synchronous, `now` as an argument.

pub mod can;
pub mod fleet;
pub mod series;
pub mod table;
