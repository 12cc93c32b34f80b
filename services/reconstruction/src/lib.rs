//! Calibrate, rectify, match, triangulate, fit the plane, grid the surface
