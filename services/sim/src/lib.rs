//! Seeded simulation: water, wind, sensors, camera rig, multicopter
