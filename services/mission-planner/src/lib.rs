//! Missions, formation slots, assignment, dispatch plans
