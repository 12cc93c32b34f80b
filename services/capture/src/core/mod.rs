//! The pure parts: poses between samples, and the table of a survey folder's frames.

pub mod frames;
pub mod pose;
