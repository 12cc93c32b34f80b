//! Missions, formation slots, assignment, dispatch plans.

fn main() -> std::process::ExitCode {
    halcyon_chassis::main(halcyon_mission_planner::run)
}
