//! What every service stands on: configuration, bus, topics, actors, clock, health, telemetry
