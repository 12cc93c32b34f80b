//! REST mission API, live stream and dashboard
