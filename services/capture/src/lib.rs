//! Stereo sources in: synchronise, stamp with pose, publish
