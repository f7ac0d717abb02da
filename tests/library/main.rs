//! The tests of the library, in one program: each file is one behaviour. `cargo test golden`
//! runs those of one file.

#[path = "../support/checkpoint.rs"]
mod checkpoint;
#[path = "../support/clone.rs"]
mod clone;
#[path = "../support/imports.rs"]
mod imports;
#[path = "../support/load.rs"]
mod load;
#[path = "../support/memory.rs"]
mod memory;
/// The robot whose detector takes long, as a user writes it.
#[path = "../../examples/own_costs.rs"]
#[allow(dead_code)] // Its `main`.
mod own_costs;
#[path = "../support/saved.rs"]
mod saved;
#[path = "../support/mod.rs"]
mod support;
#[path = "../support/table.rs"]
mod table;

mod approximate;
mod architecture;
mod by_age;
mod causes;
mod chance;
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
mod chunks;
mod circles;
mod commands;
mod costs;
mod dependencies;
mod ends;
mod executors;
mod expected;
mod external_weights;
mod falls;
mod files;
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
mod golden;
mod graph_ages;
mod graph_executors;
mod graph_file;
mod hand_over;
mod hunt;
mod idioms;
mod joints;
mod knobs;
mod libraries;
mod lineage;
mod links;
mod lqr;
mod malformed_weights;
mod matches;
mod phases;
mod plan_bars;
mod plant_cascades;
mod plant_chunks;
mod plant_motions;
mod plants;
mod policies;
mod policy_files;
mod programs;
mod push_age;
mod quadratic_cost;
mod re_execution;
mod re_execution_graphs;
mod real_clock;
mod real_triggers;
mod reproducibility;
mod robot_pictures;
mod rows;
mod stability;
mod stamps;
mod swap;
mod sweep;
mod system;
mod telemetry;
mod topic;
mod world;
