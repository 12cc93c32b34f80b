//! Wire ⇄ model, one file a subject as in `halcyon/v1/`.

mod command;
mod formation;
mod geo;
mod mission;
mod plan;
mod sea;
mod service;
mod stereo;
mod transfer;
mod vehicle;
