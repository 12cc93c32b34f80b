//! Surface patches over a window to sea state and verdict
